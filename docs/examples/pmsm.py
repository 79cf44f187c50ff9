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

# %% [markdown]
# A run of the runtime itself, `LpvObserver` beside the machine: eight random speed trajectories inside range and rate,
# voltages wrong by 5 V, currents read with a noise of 50 mA. The rate bound is hardly felt at 12 kHz: in a run of 50 ms the
# speed changes by 140 rad/s at most.

# %%
from gainsmith import GainSchedule, random_trajectories, simulate

schedule = GainSchedule.from_content(schedule_content(deployment, spec.name))
sizes = {"d_voltage_error": 5.0, "q_voltage_error": 5.0, "d_current_noise": 0.05, "q_current_noise": 0.05}
paths = random_trajectories(schedule, samples=600, runs=8)
run = simulate(schedule, schedule, paths, disturbances=sizes, inputs={"magnet_flux": 0.545}, between="moving")
print(f"speed changes by up to {np.ptp(paths, axis=1).max():.0f} rad/s in a run")
for i, state in enumerate(model.states):
    noise = run.of(f"measured_{state.name}") - run.of(state.name)[:, :-1]
    late = run.error[:, 100:, i]
    print(f"{state.name}: sensor {1e3 * noise.std():.0f} mA RMS, estimate {1e3 * late.std():.0f} mA RMS")

# %% [markdown]
# And the other end: the disturbance that this observer amplifies most, along the worst speed trajectory found, beside the
# level that was proved (`gainsmith simulate` prints the same for any schedule file).

# %%
from gainsmith import amplification

for one in amplification(schedule_content(deployment, spec.name), runs=20, samples=200):
    print(f"{one.claim}: proved {one.level:.4g}, worst run {one.worst:.4g} {one.unit} ({100.0 * one.share:.0f} %)")
