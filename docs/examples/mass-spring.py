# %% [markdown]
# # A mass on a spring that stiffens
#
# The whole way in one script: equations, gains, a table, its proof, and the observer that runs. The plant is a mass
# on a spring whose stiffness is measured and varies between 10 and 40 N/m; the sensor sees the position, and we want
# the velocity.

# %%
import matplotlib.pyplot as plt
import numpy as np
import sympy as sp
from scipy.linalg import expm

from gainsmith import (
    Channel,
    Constant,
    DeploySettings,
    GainSchedule,
    LpvModel,
    LpvVelocityObserver,
    ObserverDesign,
    SchedulingParameter,
    Signal,
    deploy,
    design_sampled_observer,
    prove,
    schedule_content,
)

m, d, k = sp.symbols("mass damping stiffness")
model = LpvModel(
    name="mass-spring",
    source="Newton",
    states=(Signal("position", "m"), Signal("velocity", "m/s")),
    inputs=(Signal("push", "N"),),
    outputs=(Signal("measured_position", "m"),),
    disturbances=(Signal("force", "N"), Signal("noise", "m")),
    parameters=(SchedulingParameter("stiffness", "N/m", 10.0, 40.0, -50.0, 50.0),),
    constants={"mass": Constant(2.0, "kg", "scale"), "damping": Constant(1.0, "N*s/m", "data sheet")},
    A=sp.Matrix([[0, 1], [-k / m, -d / m]]),
    B=sp.Matrix([0, 1 / m]),
    C=sp.Matrix([[1, 0]]),
    E=sp.Matrix([[0, 0], [1 / m, 0]]),
    F=sp.Matrix([[0, 1]]),
)

# %% [markdown]
# What is asked: the velocity error that an unknown force of 1 N together with 2 mm of noise can cause shall be as
# small as possible, for an observer that predicts and then corrects once every 10 ms. The answer is an interval: a
# lower bound for all gains of this form, and the level that was reached.

# %%
channel = Channel(("force", "noise"), ("velocity",), weights=(1.0, 0.002))
gains = design_sampled_observer(model, ObserverDesign((channel,), degree=1), sample_time=0.01)
print(f"{gains.verdict}: at least {gains.gamma_lower:.4f} m/s, reached {gains.gamma:.4f} m/s")

# %% [markdown]
# The gains become a table, rounded and linear between its breakpoints; the proof is about that table.

# %%
deployment = deploy(gains, DeploySettings(sample_time=0.01))
content = schedule_content(deployment, "mass-spring")
for proof in prove(content):
    print("proved" if proof.proved else "not proved", f"{proof.claim}: {proof.level:.4g} {proof.unit}")
schedule = GainSchedule.from_content(content)

fig, axes = plt.subplots(1, 2)
for axis, i, name in zip(axes, (0, 1), ("position", "velocity"), strict=True):
    axis.plot(schedule.breakpoints, schedule.table[:, i, 0], "o-")
    axis.set(xlabel="stiffness [N/m]", ylabel=f"gain of {name} [{schedule.gain_units[i][0]}]")
fig.savefig("mass-spring-gains.svg")

# %% [markdown]
# The observer in a loop, beside the true mass. Stiffness and push vary; the observer starts half a metre off.

# %%
observer = LpvVelocityObserver(schedule, batch_shape=())
random, x, rows = np.random.default_rng(1), np.array([0.5, 0.0]), []
for i in range(300):
    stiffness, push = 25.0 + 14.0 * np.sin(0.02 * i), 3.0 * np.sin(0.03 * i)
    step = observer.step(push, x[0] + 0.002 * random.standard_normal(), stiffness)
    held = np.array([[0.0, 1.0, 0.0], [-stiffness / 2.0, -0.5, 0.5], [0.0, 0.0, 0.0]])
    x = (expm(0.01 * held) @ [*x, push])[:2]
    rows.append((0.01 * (i + 1), x[1], step.estimate[1]))

time, true, estimated = np.array(rows).T
fig, axis = plt.subplots()
axis.plot(time, true, "k", label="true")
axis.plot(time, estimated, "--", color="tab:orange", label="estimated")
axis.set(xlabel="time [s]", ylabel="velocity [m/s]")
axis.legend()
fig.savefig("mass-spring-velocity.svg")
print(f"velocity error after 1 s: at most {np.abs(estimated - true)[100:].max():.3f} m/s")
