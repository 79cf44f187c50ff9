# %% [markdown]
# # A shipped schedule on a simulated car
#
# The five shipped schedules are for vehicle velocity: bristle deflection of the tire and relative velocity at a
# wheel, scheduled by wheel speed. Here one of them runs for 1000 launches at once.

# %%
import matplotlib.pyplot as plt
import numpy as np

from gainsmith import GainSchedule, LpvVelocityObserver

schedule = GainSchedule.shipped("corner-estimation-longitudinal")
p = schedule.parameter
print(f"{schedule.name}: {p.name} from {p.min:g} to {p.max:g} {p.unit}, every {1e3 * schedule.sample_time:g} ms")

speed = np.linspace(p.min, p.max, 200)
fig, axes = plt.subplots(1, 2)
for axis, i in zip(axes, (0, 1), strict=True):
    axis.plot(speed, schedule.gain(speed)[:, i, 0])
    axis.set(xlabel="wheel speed [rad/s]", ylabel=f"gain of {schedule.states[i].name}\n[{schedule.gain_units[i][0]}]")
fig.savefig("corner-gains.svg")

# %% [markdown]
# The plant of the schedule file is the true one here, with noise on the measured force and 10 % of the samples lost.
# A missing measurement is a NaN: the observer coasts, and says so in its flags.

# %%
cars, random, dt = 1000, np.random.default_rng(3), schedule.sample_time
observer = LpvVelocityObserver(schedule, batch_shape=(cars,))
x = np.zeros((cars, 2, 1))
x[:, 1, 0] = random.uniform(-1.0, 1.0, cars)  # relative velocity at the start, m/s: not known to the observer
errors = []
for n in range(200):
    wheel = np.full(cars, 20.0 + 0.2 * n)
    relative_acceleration = 0.5 * np.sin(0.1 * n)
    at = schedule.plant_at(wheel)
    force = (at.C @ x + at.D * relative_acceleration)[:, 0, 0] + 0.002 * random.standard_normal(cars)
    force[random.random(cars) < 0.1] = np.nan
    step = observer.step(np.full(cars, relative_acceleration), force, wheel)
    for _ in range(20):  # the plant in small steps
        x = x + dt / 20 * (at.A @ x + at.B * relative_acceleration)
    errors.append(np.abs(step.estimate[:, 1] - x[:, 1, 0]))

time = dt * np.arange(1, 201)
fig, axis = plt.subplots()
axis.semilogy(time, np.median(errors, axis=1), label="median of 1000 runs")
axis.semilogy(time, np.max(errors, axis=1), "--", label="worst of 1000 runs")
axis.set(xlabel="time [s]", ylabel="error of the relative velocity [m/s]")
axis.legend()
fig.savefig("corner-errors.svg")
print(f"lost in the last step: {np.count_nonzero(~step.used)} of {cars}; largest error {np.max(errors[-1]):.3f} m/s")
