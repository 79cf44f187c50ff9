# %% [markdown]
# # Cruise control
#
# A shipped example: the car of Åström and Murray again, this time closed. The law knows the error of the speed, its
# integral and the traction at work; the speed driven is the scheduling parameter. Every command lies within what engine and
# brakes can do: the runtime does not wind up.

# %%
import matplotlib.pyplot as plt
import numpy as np
import sympy as sp

from gainsmith import (
    Constant,
    GainSchedule,
    NonlinearModel,
    NonlinearPlant,
    Signal,
    amplification,
    deploy,
    load_spec,
    schedule_content,
    simulate,
)

spec, folder = load_spec("cruise-feedback")
model = spec.plant(folder).model
content = schedule_content(deploy(spec.design(model), spec.deploy_settings()), spec.name)
for one in amplification(content, runs=12, samples=300):
    print(
        "proved" if one.proved else "not proved", f"{one.claim}: {one.level:.4g} {one.unit}, worst run {one.worst:.4g}"
    )

# %% [markdown]
# ## The nonlinear car
#
# Its drag grows with the square of the speed, and after five seconds comes a climb. The model of the design is about
# deviations: the traction that holds 25 m/s on the flat is added to every command.

# %%
error, integral, traction, wanted, climb = sp.symbols("speed_error speed_integral traction wanted_traction climb")
m, rho, cd, area, lag, g, v0 = sp.symbols("m rho cd area lag g v0")
values = {"m": (1600.0, "kg"), "rho": (1.3, "kg/m^3"), "cd": (0.32, "1"), "area": (2.4, "m^2"), "lag": (0.5, "s")}
values |= {"g": (9.8, "m/s^2"), "v0": (25.0, "m/s")}
drag = rho * cd * area * ((v0 + error) ** 2 - v0**2) / 2
car = NonlinearModel(
    "car",
    "Åström, Murray, Feedback Systems, section 4.1",
    states=(Signal("speed_error", "m/s"), Signal("speed_integral", "m"), Signal("traction", "N")),
    outputs=(Signal("measured_error", "m/s"), Signal("measured_integral", "m")),
    inputs=(Signal("wanted_traction", "N"), Signal("climb", "1")),
    f=sp.Matrix([(traction - drag) / m - g * (sp.sin(sp.atan(climb))), error, (wanted - traction) / lag]),
    h=sp.Matrix([error, integral]),
    constants={k: Constant(x, unit, "Feedback Systems") for k, (x, unit) in values.items()},
)
schedule = GainSchedule.from_content(content)
time = schedule.sample_time * np.arange(1200)
slopes = np.where(time > 5.0, np.array([[0.06], [0.25]]), 0.0)  # the second is more than the engine can do
slopes[1, time > 20.0] = 0.0
plant = NonlinearPlant(car, {"driven_speed": 25.0 + error}, disturbances=["climb"])
run = simulate(plant, schedule, runs=2, samples=len(time), disturbances={"climb": slopes})
print(
    f"climb of 6 %: {run.of('speed_error')[0].min():.2f} m/s at worst, {run.of('speed_error')[0, -1]:.4f} m/s at the end"
)
print(f"climb of 25 %: command {run.of('wanted_traction')[1].max():.0f} N at most")

fig, axes = plt.subplots(1, 2)
for k, name in enumerate(("6 %", "25 % for 15 s")):
    axes[0].plot(run.time, run.of("speed_error")[k], label=name)
    axes[1].plot(time, run.of("wanted_traction")[k], label=name)
axes[0].set(xlabel="time [s]", ylabel="error of the speed [m/s]")
axes[1].set(xlabel="time [s]", ylabel="wanted traction, deviation [N]")
axes[0].legend()
fig.savefig("cruise.svg")
