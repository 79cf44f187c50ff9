"""The sensors of every trial: those that the project's accuracy targets are stated for."""

from __future__ import annotations

from studies.truth.sensors import Channel, Sensors

TEST_CAR = Sensors(
    wheel_speed=Channel(noise=0.05),
    acceleration=Channel(noise=0.05, bias=0.15, scale=0.01),
    rate=Channel(noise=0.002, bias=0.002, scale=0.01),
    steer=Channel(noise=0.002),
    torque=Channel(scale=0.02),
)
"""White noise of 0.05 rad/s, 0.05 m/s^2, 0.002 rad/s, 0.002 rad; per run, standard deviations: bias 0.15 m/s^2 and
0.002 rad/s, scale 1 % of the inertial sensors and 2 % of each wheel's torque."""
