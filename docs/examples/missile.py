# %% [markdown]
# # Incidence of a missile
#
# A shipped example with two scheduling parameters: the missile of Reichert's benchmark (Nichols, Reichert, Rugh 1993),
# on which gain scheduling has been tried for thirty years. Lift and moment depend on Mach number and incidence; written
# as (polynomial) times incidence, the model is quasi-LPV. Accelerometer and gyro are measured, the incidence is not.

# %%
import matplotlib.pyplot as plt
import numpy as np

from gainsmith import GainSchedule, deploy, load_spec, prove, random_trajectories, schedule_content, simulate

spec, folder = load_spec("missile-observer")
model = spec.plant(folder).model
corners = np.array([[2.0, 0.0], [2.0, 20.0], [4.0, 0.0], [4.0, 20.0]])
for (mach, size), A in zip(corners, model.on(corners).A, strict=True):
    print(f"Mach {mach:.0f}, incidence {size:2.0f} deg: poles", np.round(np.linalg.eigvals(A), 1), "1/s")

# %% [markdown]
# At high speed and small incidence the airframe is unstable; at large incidence it is a badly damped oscillator. One
# table of gains has to serve both, and Mach 2 to 4 at up to 1.5 a second.

# %%
deployment = deploy(spec.design(model), spec.deploy_settings())
content = schedule_content(deployment, spec.name)
for proof in prove(content):
    print("proved" if proof.proved else "not proved", f"{proof.claim}: {proof.level:.4g} {proof.unit}")

fig, axes = plt.subplots(1, 2)
for axis, (i, j) in zip(axes, ((0, 0), (1, 0)), strict=True):
    drawn = axis.pcolormesh(*deployment.breakpoints, deployment.table[:, :, i, j].T, shading="gouraud")
    axis.set(xlabel="Mach", ylabel="size of the incidence [deg]", title=f"{model.states[i].name} from acceleration")
    fig.colorbar(drawn)
fig.savefig("missile-gains.svg")

# %% [markdown]
# Twenty random flights through the whole box, with gusts and sensor noise; the parameters move through the samples as they
# do in flight. A simple autopilot flies on the estimates: it cancels the moment of the incidence and puts a spring of
# 15 rad/s and a damper in its place. The runtime is `LpvObserver`, all flights in one batch.

# %%
schedule = GainSchedule.from_content(content)
paths = random_trajectories(schedule, samples=400, runs=20)
wanted = 5.0 * np.sign(np.sin(2.0 * np.pi * 0.8 * schedule.sample_time * np.arange(400)))  # deg


def autopilot(k, x, estimate, p):
    """Fin, deg, for q' = -225 (incidence - wanted) - 20 q."""
    at = model.on(p)
    incidence, rate = estimate.T
    moment = -225.0 * (incidence - wanted[k]) - 20.0 * rate - at.A[:, 1, 0] * incidence
    return (moment / at.B[:, 1, 0])[:, None]


sizes = {"incidence_gust": 5.0, "moment_error": 50.0, "acceleration_noise": 0.1, "rate_noise": 0.2}
run = simulate(schedule, schedule, paths, disturbances=sizes, inputs=autopilot, estimate=[2.0, 0.0], between="moving")
late = run.error[:, 100:, 0]
print(f"incidence: error {late.std():.3f} deg RMS, largest {np.abs(late).max():.2f} deg; first error was 2 deg")

fig, axis = plt.subplots()
axis.plot(run.time, run.error[:, :, 0].T, lw=0.6)
axis.set(xlabel="time [s]", ylabel="error of the incidence [deg]", xlim=(0.0, 0.5))
fig.savefig("missile-errors.svg")

# %% [markdown]
# What the example leaves out: the gains follow the size of the incidence, which on board is the estimate itself. The proof
# is about the incidence that is given.

# %% [markdown]
# ## An autopilot with a proof
#
# `missile-feedback` is the other half: the fin from incidence and pitch rate, over the same two parameters. A law runs
# once a sample, and the loop that is proved is the one with its command held.

# %%
spec, folder = load_spec("missile-feedback")
autopilot = schedule_content(deploy(spec.design(model), spec.deploy_settings()), spec.name)
for proof in prove(autopilot):
    print("proved" if proof.proved else "not proved", f"{proof.claim}: {proof.level:.4g} {proof.unit}")

# %% [markdown]
# Flown by its runtime, `LpvController`, through the same box; each flight begins with 3 degrees of incidence.

# %%
law = GainSchedule.from_content(autopilot)
flights = simulate(
    law,
    law,
    random_trajectories(law, samples=200, runs=20),
    disturbances={"incidence_gust": 5.0, "moment_error": 50.0},
    start=[3.0, 0.0],
    between="moving",
)
fig, axes = plt.subplots(1, 2)
axes[0].plot(flights.time, flights.of("incidence").T, lw=0.6)
axes[0].set(xlabel="time [s]", ylabel="incidence [deg]")
axes[1].plot(flights.time[:-1], flights.of("fin").T, lw=0.6)
axes[1].set(xlabel="time [s]", ylabel="fin [deg]")
fig.savefig("missile-flights.svg")
late = flights.of("incidence")[:, 100:]
print(f"fin: {np.abs(flights.of('fin')).max():.0f} deg at most; incidence after 0.5 s: {late.std():.2f} deg RMS")
