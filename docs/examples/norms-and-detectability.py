# %% [markdown]
# # Norms and detectability with proofs
#
# Numbers that other tools give without saying how far they can be trusted come here with two sides, and with a third
# answer where the precision of the data ends.

# %%
import control
import matplotlib.pyplot as plt
import numpy as np

from gainsmith import detectable, distance_to_undetectability, h2_norm, hinf_norm

# %% [markdown]
# The H-infinity norm of a lightly damped oscillator has a closed form, 1/(2 z sqrt(1 - z^2)). The result has the
# peak, its frequency, and an upper bound that is proved. System objects of python-control are taken as they are.

# %%
z = 0.05
found = hinf_norm(control.tf([1], [1, 2 * z, 1]))
print(f"peak {found.norm:.12f} at {found.frequency:.4f} rad/s, proved to be below {found.upper:.12f}")
print(f"closed form {1 / (2 * z * np.sqrt(1 - z**2)):.12f}")
print("energy of the impulse response:", h2_norm(control.tf([1], [1, 2 * z, 1])))

# %% [markdown]
# Stacks are one call: 2000 oscillators at once.

# %%
damping = np.linspace(0.02, 0.9, 2000)
A = np.zeros((2000, 2, 2))
A[:, 0, 1], A[:, 1, 0], A[:, 1, 1] = 1.0, -1.0, -2.0 * damping
peaks = hinf_norm(A, [[0.0], [1.0]], [[1.0, 0.0]])
fig, axis = plt.subplots()
axis.semilogy(damping, peaks.norm)
axis.set(xlabel="damping ratio", ylabel="H-infinity norm")
fig.savefig("oscillators.svg")

# %% [markdown]
# A rotation by 0.3 rad per sample neither grows nor decays, but its entries are rounded: within the precision of the
# data it may do either, so the norm is `undecided`.

# %%
rotation = [[np.cos(0.3), -np.sin(0.3)], [np.sin(0.3), np.cos(0.3)]]
on_the_border = hinf_norm(rotation, [[0.0], [1.0]], [[1.0, 0.0]], discrete=True)
print("undecided:", bool(on_the_border.undecided), " norm:", on_the_border.norm, " upper bound:", on_the_border.upper)

# %% [markdown]
# Detectability has three verdicts, too. The first pair sees its unstable mode; the second hides it; in the third the
# sensor sees it by 1e-17, which is less than the last digit of the other entries.

# %%
unstable = [[1.0, 0.0], [0.0, -2.0]]
for row in ([1.0, 1.0], [0.0, 1.0], [1e-17, 1.0]):
    answer = detectable(unstable, [row])
    print(f"C = {row}: {answer.verdict}")
    print("   ", answer.reason)

# %% [markdown]
# How far is a pair from losing detectability? Both sides of the distance are known.

# %%
distance = distance_to_undetectability(unstable, [[0.001, 1.0]])
print(f"between {distance.lower:.3g} and {distance.upper:.3g} of the size of the matrices")
