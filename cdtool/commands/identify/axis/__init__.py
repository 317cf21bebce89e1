"""Parameters of a single axis, one file per method: rigid, two masses, friction, controller."""
