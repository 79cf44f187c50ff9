# %% [markdown]
# # Torque of the wind at a turbine
#
# A shipped example: the rotor of the NREL 5 MW turbine above rated wind. The further the blades are pitched, the more an
# angle of pitch takes away from the power: the published line is -dP/dtheta = 25.52 MW/rad (1 + pitch/0.11 rad), on which
# the gain-scheduled PI of the baseline controller rests. Its gains follow from the numbers in the model file:

# %%
import matplotlib.pyplot as plt
import numpy as np

from gainsmith import GainSchedule, deploy, load_spec, prove, random_trajectories, schedule_content, simulate

spec, folder = load_spec("wind-turbine-observer")
model = spec.plant(folder).model
value = {name: constant.value for name, constant in model.constants.items()}
inertia = value["rotor_inertia"] + value["gear_ratio"] ** 2 * value["generator_inertia"]
per_gain = inertia * value["rated_speed"] / (value["gear_ratio"] * value["sensitivity"])
print(
    f"KP = {2.0 * 0.7 * 0.6 * per_gain:.7f} s (published 0.01882681), KI = {0.6**2 * per_gain:.8f} (published 0.008068634)"
)

# %% [markdown]
# The observer finds what the wind adds to the torque, from generator speed and pitch. That is the signal a feedforward of
# pitch starts from.

# %%
deployment = deploy(spec.design(model), spec.deploy_settings())
content = schedule_content(deployment, spec.name)
for proof in prove(content):
    print("proved" if proof.proved else "not proved", f"{proof.claim}: {proof.level:.4g} {proof.unit}")

# %% [markdown]
# A gust of 1 MN m that rises within five seconds, while the operating point wanders through its range. The baseline's PI
# runs in the loop, on the estimates, with its gains scheduled by pitch as published.

# %%
schedule = GainSchedule.from_content(content)
T = schedule.sample_time
paths = random_trajectories(schedule, samples=1200, runs=6, seed=2, families=["band-limited"])
integral = np.zeros((6, 1))


def baseline(k, x, estimate, p):
    """PI on the estimated speed, as on the high-speed shaft."""
    error = value["gear_ratio"] * estimate[:, :1]
    integral[:] += T * error
    return (0.01882681 * error + 0.008068634 * integral) / (1.0 + p / value["doubling_pitch"])


time = T * np.arange(1200)
gust = np.where((time > 20.0) & (time < 25.0), 0.2, 0.0)
noise = {"gust": gust, "speed_noise": 0.05, "pitch_noise": 0.001}
run = simulate(schedule, schedule, paths, disturbances=noise, inputs=baseline, between="moving")
late = run.error[:, -200:, 2]
print(f"wind torque: true 1 MN m, found {run.estimate[:, -200:, 2].mean():.3f} MN m, error {late.std():.3f} MN m RMS")

fig, axes = plt.subplots(1, 2)
axes[0].plot(run.time, run.state[:, :, 2].T, "k", lw=1.0)
axes[0].plot(run.time, run.estimate[:, :, 2].T, lw=0.6)
axes[0].set(xlabel="time [s]", ylabel="torque of the wind [MN m]", xlim=(15.0, 35.0))
axes[1].plot(run.time, run.state[:, :, 0].T, lw=0.8)
axes[1].set(xlabel="time [s]", ylabel="rotor speed, deviation [rad/s]")
fig.savefig("wind-turbine-gust.svg")

# %% [markdown]
# ## The published controller, proved
#
# `turbine-pitch` is the model for control: rotor speed, its integral, the actuator. Is the published PI, tabulated over
# the pitch and run at 20 Hz, stable however the operating point moves? The claims of any table can be searched for:

# %%
from flint import fmpq_mat

from gainsmith import load_model
from studies.spec import shipped_examples
from synthesis.certificate.levels import feedback_claims
from synthesis.certificate.search import Search, Wish
from synthesis.design.feedback_channel import FeedbackChannel, feedback_names
from synthesis.loop.feedback import FeedbackLoop
from synthesis.loop.from_model import plant_of
from synthesis.polynomials.rational import decimal

pitched = load_model(shipped_examples()["turbine-pitch"])
channel = FeedbackChannel(
    ("wind_torque", "pitch_error"),
    ("rotor_speed", "rotor_angle", "wanted_pitch"),
    weights=(0.5, 0.02),  # MN m, rad/s
    sizes=(0.06, 0.2, 0.1),  # rad/s, rad, rad
)
points = [round(0.05125 * k, 5) for k in range(9)]
less = [1.0 / (1.0 + x / value["doubling_pitch"]) for x in points]
table = {(k,): fmpq_mat([[decimal(round(g * x, 9)) for g in (0.01882681, 0.008068634)]]) for k, x in enumerate(less)}
loop = FeedbackLoop(plant_of(pitched), (tuple(decimal(x) for x in points),), table, "outputs", sample_time=decimal(T))
for claim in feedback_claims(
    Search(loop, feedback_names(pitched), pitched.parameters), [Wish("gain", None, channel.claim)], settle=0.005
):
    print(f"published PI: {claim.kind} {claim.level:.4g}")

# %% [markdown]
# It is, with a decay of 0.26 1/s on the whole range. `turbine-pitch-feedback` is a table of PI gains for the channel asked
# for here, found in steps from the published gains at zero pitch; a state feedback knows the pitch at work as well.

# %%
from synthesis.design.deploy_settings import DeploySettings
from synthesis.design.state_feedback import StateFeedbackDesign, design_state_feedback

spec, folder = load_spec("turbine-pitch-feedback")
states = design_state_feedback(pitched, StateFeedbackDesign((channel,), decay_rate=0.15, fastest_pole=6.0))
laws = {
    "PI table": deploy(spec.design(pitched), spec.deploy_settings()),
    "state feedback": deploy(states, DeploySettings(T)),
}
fig, axis = plt.subplots()
for (name, law), color in zip(laws.items(), ("tab:blue", "tab:orange"), strict=True):
    content = schedule_content(law, "turbine")
    for proof in prove(content):
        print(f"{name}: {'proved' if proof.proved else 'not proved'} {proof.kind} {proof.level:.4g}")
    runtime = GainSchedule.from_content(content)
    gusts = np.where((time > 5.0) & (time < 8.0), 0.5, 0.0)
    run = simulate(runtime, runtime, paths, disturbances={"wind_torque": gusts}, between="moving")
    axis.plot(run.time, run.of("rotor_speed").T, color=color, lw=0.6)
    axis.plot([], [], color=color, label=name)
axis.set(xlabel="time [s]", ylabel="rotor speed, deviation [rad/s]", xlim=(0.0, 40.0))
axis.legend()
fig.savefig("wind-turbine-control.svg")
