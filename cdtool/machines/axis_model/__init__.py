"""One axis in closed loop: drive, load, friction, controller and sensors, as identification and injection use it.

All quantities are on the load side (kg, m, N; or kg m2, rad, N m for a rotary axis). The parameters are the table
[model] of the machine file.
"""
