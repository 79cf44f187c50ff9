# %% [markdown]
# # An inverted pendulum on a lifted base
#
# The third shipped example has an unstable plant: an error grows by itself, so every lost sample costs. The
# scheduling parameter is the gravity that the pendulum feels while its base is lifted and lowered.

# %%
import matplotlib.pyplot as plt
import numpy as np

from gainsmith import critical_drop_probability, deploy, load_spec, prove, schedule_content, undetectable_mode

spec, folder = load_spec("inverted-pendulum-observer")
model = spec.plant(folder).model
gravity = np.linspace(6.8, 12.8, 61)
poles = np.linalg.eigvals(model.on(gravity).A)
print(f"fastest growth: {poles.real.max():.2f} 1/s; hidden modes that do not decay: {undetectable_mode(model)}")

# %% [markdown]
# Design for an observer that corrects every 5 ms, and prove. The proof says which share of lost samples is surely
# survived.

# %%
deployment = deploy(spec.design(model), spec.deploy_settings())
proofs = prove(schedule_content(deployment, spec.name))
for proof in proofs:
    print("proved" if proof.proved else "not proved", f"{proof.claim}: {proof.level:.4g} {proof.unit}")

# %% [markdown]
# Beside the proof, for every parameter value in its range and every admissible motion, stands what frozen parameters
# would allow: an upper limit that proves nothing about motion, and shows how little is given away.

# %%
from scipy.linalg import expm

lost = np.array([expm(spec.deploy.sample_time * A) for A in model.on(gravity).A])
columns = [
    [np.interp(gravity, deployment.breakpoints[0], deployment.table[:, i, j]) for j in range(2)] for i in range(4)
]
gain = np.moveaxis(np.array(columns), 2, 0)
received = lost - gain @ model.on(gravity).C
frozen = critical_drop_probability(lost, received)
proved = next(proof.level for proof in proofs if proof.kind == "drop probability")

fig, axis = plt.subplots()
axis.plot(gravity, frozen, label="limit with the parameter frozen")
axis.axhline(proved, color="tab:orange", linestyle="--", label="proved for every motion")
axis.set(xlabel="effective gravity [m/s^2]", ylabel="drop probability", ylim=(0.0, 1.05))
axis.legend(loc="lower left")
fig.savefig("pendulum-drops.svg")
print(f"frozen limit {frozen.min():.4f}, proved {proved:.4f}")
