# %% [markdown]
# # Currents of a synchronous machine at 12 kHz
#
# Another shipped example. The currents of a permanent-magnet machine are coupled through the electrical speed, which
# is the scheduling parameter; it runs from -471 to 471 rad/s. The observer filters the measured currents without
# delay.

# %%
import matplotlib.pyplot as plt
import numpy as np

from gainsmith import deploy, load_spec, prove, schedule_content

spec, folder = load_spec("pmsm-observer")
model = spec.plant(folder).model
deployment = deploy(spec.design(model), spec.deploy_settings())
for proof in prove(schedule_content(deployment, spec.name)):
    print("proved" if proof.proved else "not proved", f"{proof.claim}: {proof.level:.4g} {proof.unit}")

# %% [markdown]
# The four gains over the speed. The couplings change sign with it: a constant gain would have to leave them out.

# %%
speed = deployment.breakpoints[0]
fig, axes = plt.subplots(1, 2)
for axis, kind in zip(axes, ("own", "coupling"), strict=True):
    for i, j in ((0, 0), (1, 1)) if kind == "own" else ((0, 1), (1, 0)):
        axis.plot(speed, deployment.table[:, i, j], "o-", label=f"{model.states[i].name} from {model.outputs[j].name}")
    axis.set(xlabel="electrical speed [rad/s]", ylabel="gain [A/A]")
    axis.legend(fontsize=7)
fig.savefig("pmsm-gains.svg")

# %% [markdown]
# How large are the poles of the machine itself, beside the sample time of 83 microseconds? The prediction is exact,
# so the observer does not care; Euler steps would.

# %%
poles = np.linalg.eigvals(model.on(np.linspace(-471.0, 471.0, 5)).A)
for at, pair in zip(np.linspace(-471.0, 471.0, 5), poles, strict=True):
    print(f"{at:6.0f} rad/s: poles {pair[0]:.0f}, {pair[1]:.0f} 1/s")
