# %% [markdown]
# # Which parameter eats the margin?
#
# An observer was designed for published tire values. On the road they are off. How much does each one matter: alone,
# in the worst corner, and as a share of the variance?

# %%
import matplotlib.pyplot as plt
import numpy as np

from gainsmith import (
    GainSchedule,
    PerturbedModel,
    around,
    corner_velocity_model,
    error_measure,
    load_parameter_set,
    one_at_a_time,
    stability_margin,
    variance_indices,
    worst_case,
)

model = corner_velocity_model(load_parameter_set("corner-estimation"), "longitudinal", wheel_speed_maximum=180.0)
family = PerturbedModel(model)
gain = GainSchedule.shipped("corner-estimation-longitudinal").gain(60.0)
margin = error_measure(family, gain, lambda A, B: stability_margin(A), wheel_speed=60.0)  # max Re of the poles, 1/s
print("varied:", ", ".join(f"{name} = {value:g}" for name, value in family.nominal.items()))

# %% [markdown]
# One at a time, 20 % down and up.

# %%
found = one_at_a_time(margin, family.nominal, factors=(0.8, 1.2), name="stability margin", unit="1/s")
nominal = float(found.nominal.values)
names = list(family.nominal)
rows = np.asarray(found.values.values)
fig, axis = plt.subplots()
for i, (low, high) in enumerate(rows):
    axis.plot([low, high], [i, i], color="0.6", zorder=1)
    axis.scatter([low], [i], color="tab:blue", marker="v", label="20 % less" if i == 0 else None)
    axis.scatter([high], [i], color="tab:orange", marker="^", label="20 % more" if i == 0 else None)
axis.axvline(nominal, color="k", linewidth=0.8)
axis.set(yticks=range(len(names)), yticklabels=names, xlabel="slowest pole [1/s]; further left is better")
axis.legend()
fig.savefig("one-at-a-time.svg")

# %% [markdown]
# All at once: shares of the variance (Sobol indices), and the worst place in the box.

# %%
ranges = around(family.nominal, 0.2)
shares = variance_indices(margin, ranges, samples=512)
for name, total in zip(names, np.asarray(shares.total.values), strict=True):
    print(f"{name:24s} {100 * float(total):5.1f} % of the variance")
worst = worst_case(margin, ranges)
print(f"nominal {nominal:.1f} 1/s, worst {worst.value:.1f} 1/s")
