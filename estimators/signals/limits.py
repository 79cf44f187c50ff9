"""What no car measures: beyond, a sample is a fault of the sensor or of its unit, and counts as missing."""

ACCELERATION = 100.0  # m/s^2
YAW_RATE = 20.0  # rad/s
YAW_ACCELERATION = 1000.0  # rad/s^2
ANGLE = 1.5  # rad, of road wheels and of the body
WHEEL_SPEED = 1000.0  # rad/s
TORQUE = 1e5  # N m, of one wheel
FRICTION = 1.5  # |F/F_z| of a tire
FORCE = 1e5  # N, of one wheel or axle
SPEED = 300.0  # m/s
