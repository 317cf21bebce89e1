"""Parameters of a robot of several joints: base parameters, friction, torque constants."""
