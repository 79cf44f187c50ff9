# %% [markdown]
# # State of charge of a cell
#
# A shipped example: a lithium-ion cell of 27 A h. Counting the charge drifts; the voltage tells the state of charge where
# the open-circuit voltage is steep and says little where it is flat. The slope is the scheduled part: a polynomial of the
# state of charge, fitted to the table of MathWorks' example.

# %%
import matplotlib.pyplot as plt
import numpy as np

from gainsmith import GainSchedule, deploy, load_spec, prove, random_trajectories, schedule_content, simulate

spec, folder = load_spec("battery-observer")
model = spec.plant(folder).model
charge = np.linspace(0.1, 0.9, 81)
slope = model.on(charge).C[:, 0, 0]
print(
    f"slope: {1e3 * slope.min():.1f} mV/percent at {charge[slope.argmin()]:.0%}, {1e3 * slope.max():.1f} at its steepest"
)

# %% [markdown]
# A slow design: 10 mV of the voltage are noise and what the fit leaves over, so that the correction takes minutes. It is
# asked for by a decay rate; without one the optimum is flat, because at rest noise cannot be told from charge.

# %%
deployment = deploy(spec.design(model), spec.deploy_settings())
content = schedule_content(deployment, spec.name)
for proof in prove(content):
    print("proved" if proof.proved else "not proved", f"{proof.claim}: {proof.level:.4g} {proof.unit}")

# %% [markdown]
# Ten cells whose count begins 10 % wrong, a sensor of current with an offset of 0.5 A, an hour of charging and
# discharging.

# %%
schedule = GainSchedule.from_content(content)
samples = 7200
paths = random_trajectories(schedule, samples=samples, runs=10, families=["sinusoid", "band-limited"])
current = 97200.0 * np.diff(paths[..., 0]) / schedule.sample_time  # A, that moves the charge along each trajectory
run = simulate(
    schedule,
    schedule,
    paths,
    inputs={"current": current},
    disturbances={"current_error": np.full(samples, 0.5), "voltage_noise": 0.005},
    start=[10.0, 0.0],
)
error = run.error[:, :, 0]
offset = run.time[-1] * 0.5 / 972.0
print(f"after an hour: error {np.abs(error[:, -1]).mean():.2f} %, counting alone {10.0 + offset:.1f} %")

fig, axes = plt.subplots(1, 2)
axes[0].plot(100.0 * charge, 1e3 * slope)
axes[0].set(xlabel="state of charge [%]", ylabel="slope of the voltage [mV/%]")
axes[1].plot(run.time / 60.0, error.T, lw=0.7)
axes[1].set(xlabel="time [min]", ylabel="error of the state of charge [%]")
fig.savefig("battery-charge.svg")
