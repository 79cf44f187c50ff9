# %% [markdown]
# # Rates of a flexible satellite
#
# A shipped example: two bodies joined by a boom (LMI Control Toolbox, 1995). Stiffness and damping of the boom lie within
# bounds and drift; they are the two scheduling parameters. Two angles are measured, two rates are wanted.

# %%
import numpy as np

from gainsmith import GainSchedule, deploy, load_spec, prove, random_trajectories, schedule_content, simulate

spec, folder = load_spec("satellite-observer")
model = spec.plant(folder).model
for stiffness in (0.09, 0.4):
    A = model.on([[stiffness, 0.0038]]).A[0]
    print(f"stiffness {stiffness} N m/rad: flexible mode at {np.abs(np.linalg.eigvals(A)).max():.3f} rad/s")

# %%
deployment = deploy(spec.design(model), spec.deploy_settings())
content = schedule_content(deployment, spec.name)
for proof in prove(content):
    print("proved" if proof.proved else "not proved", f"{proof.claim}: {proof.level:.4g} {proof.unit}")
print("breakpoints:", *(len(points) for points in deployment.breakpoints), "of", *(p.name for p in model.parameters))

# %% [markdown]
# Differences of the measured angles over a sample are the obvious way to rates. Beside it the observer, on the same
# noise, with a tenth of all samples lost in transmission: the runtime coasts through them.

# %%
schedule = GainSchedule.from_content(content)
paths = random_trajectories(schedule, samples=600, runs=20)
sizes = {"disturbing_torque": 0.001, "bus_noise": 1e-4, "instrument_noise": 1e-4}
for drops in (0.0, 0.1):
    run = simulate(schedule, schedule, paths, disturbances=sizes, drops=drops)
    for i, name in ((2, "bus"), (3, "instrument")):
        angle = run.of(f"measured_{name}_angle")
        crude = np.diff(angle) / schedule.sample_time - run.of(f"{name}_rate")[:, 1:-1]
        error = run.error[:, 100:, i]
        print(
            f"lost {drops:.0%}: {name}_rate {1e3 * error.std():.2f} mrad/s RMS, by differences {1e3 * crude.std():.2f}"
        )

# %% [markdown]
# ## Pointing
#
# `satellite-feedback`: the torque of the bus points the instruments, through the boom. The wheel gives 0.1 N m.

# %%
spec, folder = load_spec("satellite-feedback")
pointing = schedule_content(deploy(spec.design(model), spec.deploy_settings()), spec.name)
for proof in prove(pointing):
    print("proved" if proof.proved else "not proved", f"{proof.claim}: {proof.level:.4g} {proof.unit}")

law = GainSchedule.from_content(pointing)
run = simulate(
    law,
    law,
    random_trajectories(law, samples=400, runs=12),
    disturbances={"disturbing_torque": 0.005},
    start=[0.01, 0.01, 0.0, 0.0],
)
late, torque = 1e3 * run.of("instrument_angle")[:, 150:], run.of("torque")
print(f"10 mrad off at first; after 15 s {np.abs(late).max():.2f} mrad at most; torque {np.abs(torque).max():.3f} N m")
