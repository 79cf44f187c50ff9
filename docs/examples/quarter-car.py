# %% [markdown]
# # Wheel load of a quarter car
#
# A shipped example: four states, two sensors, a damper whose valve is set while driving. The tire deflection, and
# with it the wheel load, is not measured; the observer finds it from suspension deflection and body acceleration.

# %%
import matplotlib.pyplot as plt
import numpy as np
from scipy.linalg import expm

from gainsmith import deploy, load_spec, observability_over_range, prove, schedule_content

spec, folder = load_spec("quarter-car-observer")
model = spec.plant(folder).model
print(model.name, [s.name for s in model.states], "from", [s.name for s in model.outputs])

# %% [markdown]
# Can it work at all? Observability is decided over the whole range of the damping and of its rate, not at frozen
# points.

# %%
found = observability_over_range(model)
print(f"rank: {found.verdict}, proved with the outputs and {found.blocks - 1} of their derivatives")

# %% [markdown]
# Design, table, proof. Four states and two sensors: eight gains, each a function of the damping.

# %%
gains = spec.design(model)
deployment = deploy(gains, spec.deploy_settings())
for proof in prove(schedule_content(deployment, spec.name)):
    print("proved" if proof.proved else "not proved", f"{proof.claim}: {proof.level:.4g} {proof.unit}")

fig, axes = plt.subplots(1, 2, sharex=True)
damping = deployment.breakpoints[0]
for axis, j, sensor in zip(axes, (0, 1), model.outputs, strict=True):
    for i, state in enumerate(model.states):
        axis.plot(damping, deployment.table[:, i, j] / np.abs(deployment.table[:, i, j]).max(), "o-", label=state.name)
    axis.set(title=sensor.name, xlabel="damping [N s/m]", ylabel="gain, its largest = 1")
axes[0].legend(fontsize=7)
fig.savefig("quarter-car-gains.svg")

# %% [markdown]
# A rough road, the valve switching between soft and firm: the tire deflection, true and estimated. The update is
# written out here, so that every line of it can be seen: predict over the sample, then correct with the gain at the
# damping of now.

# %%
T, random = spec.deploy.sample_time, np.random.default_rng(0)
x, estimate, road, rows = np.zeros(4), np.zeros(4), 0.0, []
for n in range(1000):
    c = 1500.0 + 900.0 * np.sin(2.0 * np.pi * 0.8 * n * T)
    at = model.on([c])
    A, C, E = at.A[0], at.C[0], at.E[0][:, :1]
    y = C @ x + [0.001, 0.1] * random.standard_normal(2)
    gain = [[np.interp(c, damping, deployment.table[:, i, j]) for j in range(2)] for i in range(4)]
    estimate = expm(T * A) @ estimate + np.array(gain) @ (y - C @ estimate)
    road = 0.96 * road + 0.08 * random.standard_normal()  # 0.3 m/s RMS, up to about 3 Hz
    both = expm(T * np.block([[A, E], [np.zeros((1, 5))]]))
    x = (both @ [*x, road])[:4]
    rows.append((T * (n + 1), x[2], estimate[2]))

time, true, found = np.array(rows).T
fig, axis = plt.subplots()
axis.plot(time, 190.0 * true, "k", label="true")
axis.plot(time, 190.0 * found, "--", color="tab:orange", label="estimated")
axis.set(xlabel="time [s]", ylabel="wheel load, change [kN]", xlim=(1.0, 2.0))
axis.legend(loc="upper right")
fig.savefig("quarter-car-load.svg")
print(
    f"change of wheel load: {190e3 * true.std():.0f} N RMS, error of its estimate {190e3 * (found - true).std():.0f} N RMS"
)
