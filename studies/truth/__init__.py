"""Truth vehicles that no estimator has seen, manoeuvres as data, and the sensors in between.

A double-track vehicle (planar motion, heave, roll, pitch, load transfer, four spinning wheels, suspension compliance) on
combined-slip LuGre tires or on the Magic Formula with slip lag is driven through manoeuvres of TOML files, all at once;
sensor errors are then drawn for as many seeds as wanted from the one truth:

    from estimators.pipeline import EstimationPipeline
    from studies.truth import Sensors, draw, load_manoeuvre, simulate_manoeuvres

    manoeuvres = [load_manoeuvre("p1-launch-split"), load_manoeuvre("p1-lane-change-dry")]
    truth = simulate_manoeuvres(manoeuvres)        # B runs, 200 Hz; truth.names, truth.valid (B, n), truth.vehicles
    one = truth.only("p1-launch-split")            # one manoeuvre, cut to its own length
    measured = draw(one, Sensors(), seeds=range(8))
    pipeline = EstimationPipeline(one.vehicles[0].parameters, measured.sample_time, measured.batch_shape)
    steps = [pipeline.step(signals) for signals in measured]   # VehicleSignals of shape (8, 1)
    error = steps[-1].vx - one["vx"][:, -1]        # (seeds, runs)
"""

from studies.errors import SimulationError
from studies.truth.drivetrain import Assist, Drivetrain
from studies.truth.export import write_drive
from studies.truth.manoeuvre import Manoeuvre, load_manoeuvre, shipped_manoeuvres, simulate_manoeuvres
from studies.truth.record import Truth
from studies.truth.sensors import PERFECT, Channel, Drops, Measured, Sensors, Ticks, draw
from studies.truth.signals import UNITS
from studies.truth.simulate import simulate
from studies.truth.vehicle import Chassis, TruthVehicle, load_vehicle, varied

__all__ = [
    "PERFECT", "UNITS", "Assist", "Channel", "Chassis", "Drivetrain", "Drops", "Manoeuvre", "Measured", "Sensors",
    "SimulationError", "Ticks", "Truth", "TruthVehicle", "draw", "load_manoeuvre", "load_vehicle",
    "shipped_manoeuvres", "simulate", "simulate_manoeuvres", "varied", "write_drive",
]  # fmt: skip
