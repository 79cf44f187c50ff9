# %% [markdown]
# # How many lost samples does an observer survive?
#
# A measurement that arrives corrects the error, one that is lost lets it grow. With losses at random the error is a
# Markov jump system; it is mean-square stable below a critical drop probability.

# %%
import matplotlib.pyplot as plt
import numpy as np

from gainsmith import (
    GainSchedule,
    critical_drop_interval,
    critical_drop_probability,
    drop_verdict,
    frozen_critical_probability,
    gilbert_elliott,
)

lost = np.array([[1.1, 0.2], [0.0, 0.9]])  # the error over a sample without a measurement: it grows
received = np.array([[0.4, 0.1], [-0.1, 0.5]])
critical = float(critical_drop_probability(lost, received))
interval = critical_drop_interval(lost, received)
print(f"critical probability {critical:.6f}")
print(f"for every pair that rounds to these numbers between {interval.lower:.15f} and {interval.upper:.15f}")

# %% [markdown]
# A verdict knows a third answer: if the entries are known to 1 % only, a probability near the limit is undecided.

# %%
for p in (critical - 0.1, critical, critical + 0.1):
    print(f"p = {p:.3f}: {drop_verdict(lost, received, p, relative=0.01)}")

# %% [markdown]
# The same by brute force: 4000 runs. The mean square falls below the limit and grows above it.

# %%
random, runs, steps = np.random.default_rng(0), 4000, 60
fig, axis = plt.subplots()
for p in (critical - 0.15, critical, critical + 0.1):
    e = np.tile(np.array([[1.0], [1.0]]), (runs, 1, 1))
    square = []
    for _ in range(steps):
        dropped = (random.random(runs) < p)[:, None, None]
        e = np.where(dropped, lost, received) @ e
        square.append(np.mean(np.sum(e**2, axis=1)))
    axis.semilogy(square, label=f"p = {p:.2f}")
axis.set(xlabel="sample", ylabel="mean square of the error")
axis.legend(title="drop probability")
fig.savefig("drops-mean-square.svg")

# %% [markdown]
# Losses come in bursts. In the model of Gilbert and Elliott the channel fails with one probability and recovers with
# another; a third of the samples is lost in both of these, but one loses them singly and the other in a row.

# %%
for failure, recovery in ((0.5, 1.0), (0.05, 0.1)):
    system = gilbert_elliott(lost, received, failure, recovery)
    share = failure / (failure + recovery)
    print(f"{share:.2f} lost, {1 / recovery:.0f} in a row on average: {system.verdict()}")

# %% [markdown]
# Of a shipped schedule, over its whole range, with the parameter frozen; `gainsmith certify` proves the number that
# holds in motion.

# %%
print(frozen_critical_probability(GainSchedule.shipped("resilient-velocity-lateral")).message)
