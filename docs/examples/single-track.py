# %% [markdown]
# # How fast a car slides sideways
#
# A shipped example: the single-track model of a car with linear tires. The slip angles of its axles are velocities divided
# by the speed V, so that entries with V and with 1/V stand side by side: the model is rational in its scheduling parameter.
# Speeds from 5 to 40 m/s are covered; at V = 0 the model has no meaning, and a range that reaches it is refused.

# %%
import matplotlib.pyplot as plt
import numpy as np

from gainsmith import GainSchedule, deploy, load_spec, prove, schedule_content, simulate

spec, folder = load_spec("single-track-observer")
model = spec.plant(folder).model
for V, A in zip((5.0, 40.0), model.on([5.0, 40.0]).A, strict=True):
    print(f"V = {V:g} m/s: poles", np.round(np.linalg.eigvals(A), 2), "1/s")

# %% [markdown]
# The observer finds the side velocity from yaw rate, lateral acceleration and steering angle. Its file holds the matrices as
# polynomials over one denominator, here V divided by its middle value. The proof needs the matrix exponential of the quotient:
# on every cell of the table 1/V is enclosed by a polynomial with a bounded remainder.

# %%
deployment = deploy(spec.design(model), spec.deploy_settings())
content = schedule_content(deployment, spec.name)
print("denominator:", content["plant"]["denominator"])
for proof in prove(content):
    print("proved" if proof.proved else "not proved", f"{proof.claim}: {proof.level:.4g} {proof.unit}")

# %% [markdown]
# A lane change while the car brakes from 35 m/s, with a gust of 400 N. The plant moves between the samples, too.

# %%
schedule = GainSchedule.from_content(content)
time = schedule.sample_time * np.arange(401)
speed = np.clip(35.0 - 8.0 * np.maximum(time - 1.0, 0.0), 12.0, None)
steering = 0.03 * np.sin(2.0 * np.pi * time / 2.0) * (time < 2.0)
gust = np.where(time > 2.5, 400.0, 0.0)
run = simulate(
    schedule,
    schedule,
    speed[None, :, None],
    disturbances={"side_force": gust[:-1], "yaw_rate_noise": 0.003, "acceleration_noise": 0.1},
    inputs=lambda k, x, estimate, p: np.full((1, 1), steering[k]),
    between="moving",
)
error = run.error[0, :, 0]
print(f"side velocity: up to {np.abs(run.state[0, :, 0]).max():.2f} m/s, error {error.std():.3f} m/s RMS")

fig, axis = plt.subplots()
axis.plot(run.time, run.state[0, :, 0], "k", label="true")
axis.plot(run.time, run.estimate[0, :, 0], color="tab:orange", lw=0.8, label="found")
axis.set(xlabel="time [s]", ylabel="side velocity [m/s]")
axis.legend()
fig.savefig("single-track.svg")
