# %% [markdown]
# # The slope of the road under a car
#
# A shipped example: the car of Åström and Murray's cruise control. The observer knows the speed and the traction that
# engine and brakes are asked for; what is missing in the balance of forces is slope, rolling resistance and wind.
#
# Drag grows with the square of the speed. Written as (drag at this speed) times speed, with the speed itself as the
# scheduling parameter, the model is linear, and exact.

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
    deploy,
    load_spec,
    prove,
    schedule_content,
    simulate,
)

spec, folder = load_spec("vehicle-speed-observer")
model = spec.plant(folder).model
deployment = deploy(spec.design(model), spec.deploy_settings())
content = schedule_content(deployment, spec.name)
for proof in prove(content):
    print("proved" if proof.proved else "not proved", f"{proof.claim}: {proof.level:.4g} {proof.unit}")

# %% [markdown]
# The gains hardly depend on the speed: drag changes slowly beside the observer. One gain would do here; that it does,
# at every speed and under full braking, is what the proof says.

# %%
print(np.ptp(deployment.table, axis=0).ravel() / np.abs(deployment.table).max(axis=0).ravel())

# %% [markdown]
# ## Against the nonlinear car
#
# The truth is the nonlinear model with slope and rolling resistance, not the model of the design. The driver holds 30 m/s
# with a proportional controller; after ten seconds comes a climb of 4 %, after 25 s a descent of 2 %.

# %%
v, f, demand, climb = sp.symbols("speed traction wanted_traction climb")
m, rho, cd, area, lag, g, cr = sp.symbols("m rho cd area lag g cr")
values = {"m": (1600.0, "kg"), "rho": (1.3, "kg/m^3"), "cd": (0.32, "1"), "area": (2.4, "m^2"), "lag": (0.5, "s")}
values |= {"g": (9.8, "m/s^2"), "cr": (0.01, "1")}
car = NonlinearModel(
    "car",
    "Åström, Murray, Feedback Systems, section 4.1",
    states=(Signal("speed", "m/s"), Signal("traction", "N")),
    outputs=(Signal("measured_speed", "m/s"),),
    inputs=(Signal("wanted_traction", "N"), Signal("climb", "1")),
    f=sp.Matrix([(f - rho * cd * area * v**2 / 2) / m - g * (sp.sin(sp.atan(climb)) + cr), (demand - f) / lag]),
    h=sp.Matrix([v]),
    constants={name: Constant(x, unit, "Feedback Systems; the lag is ours") for name, (x, unit) in values.items()},
)
schedule = GainSchedule.from_content(content)
time = schedule.sample_time * np.arange(2000)
slope = np.where(time < 10.0, 0.0, np.where(time < 25.0, 0.04, -0.02))
run = simulate(
    NonlinearPlant(car, {"driven_speed": "speed"}, disturbances=["climb"]),
    schedule,
    runs=1,
    samples=len(time),
    disturbances={"climb": slope, "measured_speed_noise": 0.02},
    inputs=lambda k, x, estimate, p: 2000.0 * (30.0 - estimate[:, :1]) + estimate[:, 2:],
    start=[30.0, 500.0],
    estimate=[30.0, 500.0, 0.0],
)
found = run.estimate[0, 1:, 2]
true = 1600.0 * 9.8 * (np.sin(np.arctan(slope)) + 0.01)
for end in (9.5, 24.5, 39.5):
    k = int(end / schedule.sample_time)
    print(f"at {end:4.1f} s: true {true[k]:6.0f} N, found {found[k - 50 : k].mean():6.0f} N")

fig, axis = plt.subplots()
axis.plot(time, true, "k", label="true: slope and rolling resistance")
axis.plot(time, found, color="tab:orange", lw=0.8, label="found")
axis.set(xlabel="time [s]", ylabel="force of the road [N]")
axis.legend()
fig.savefig("vehicle-road-force.svg")
