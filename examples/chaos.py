r"""
Chaos and its basins
====================

A ball on a table that shakes harder and harder bounces once a period, then once every two, four, ...
periods, then as it likes. The first doubling has a closed form (Luck and Mehta 1993): it comes at a
peak acceleration of the table, over gravity, of

.. math:: \sqrt{\left(\pi\,\frac{1 - e}{1 + e}\right)^2 + \left(\frac{2(1 + e^2)}{(1 + e)^2}\right)^2} .
"""

import matplotlib.pyplot as plt
import numpy as np

import rocking
from rocking import dynamics

e, g, frequency = 0.5, 10.0, 5.0
ball = dynamics.BouncingBall(e, gravity=g)


def shaken(ratio):
    """Return the ball, and one period of a table of this peak acceleration over g."""
    return ball, rocking.pulses.sine(g * ratio, frequency, cycles=1)


# %%
# The orbit of one bounce a period is followed to where a multiplier of its map is -1:

orbit = next(each for each in dynamics.periodic_orbits(*shaken(1.2)) if each.is_stable and each.impact_count == 1)
branch = dynamics.continue_orbit(orbit, shaken, 1.2, (1.1, 1.6))
(doubling,) = (each.value for each in branch.bifurcations if each.kind == "flip")
closed_form = np.hypot(np.pi * (1.0 - e) / (1.0 + e), 2.0 * (1.0 + e * e) / (1.0 + e) ** 2)
difference = doubling - closed_form
print(f"the period doubles at {doubling:.9f}; in closed form at {closed_form:.9f}")

# %%
# A livelier ball never settles: two neighbouring states part exponentially.

lively = dynamics.BouncingBall(0.9, gravity=g)
exponents = dynamics.lyapunov_exponents(lively, shaken(5.0)[1], [0.1, 0.5], period_count=3000)
largest, error = exponents.largest, exponents.standard_error
print(f"largest Lyapunov exponent {largest:.2f} a period, standard error {error:.2f}")

# %%
# A block under a sine that goes on for ever settles on one of two orbits, or overturns to one side or
# the other, depending on how it starts. The estimated dimension of the boundary between these outcomes is
# above 1 on this grid, as of a fractal.

block = rocking.Block.from_parameters(p=3.0, alpha=0.25, restitution=0.9)
sine = rocking.pulses.sine(6.0, 2.5, cycles=1)
basins = dynamics.basins(block, sine, np.linspace(-0.25, 0.25, 120), np.linspace(-0.75, 0.75, 120))
shares = basins.data.share.values
for name, share in zip(basins.data.attractor.values, shares, strict=True):
    print(f"{name}: {100.0 * share:.1f} %")

# %%
# The share of states with a neighbour k cells away that has another outcome grows as k to the power of two minus
# the dimension (McDonald and others 1985).

outcome, steps = basins.data.outcome.values, (1, 2, 4)
uncertain = []
for k in steps:
    middle, rows, columns = outcome[k:-k, k:-k], outcome[:, k:-k], outcome[k:-k]
    differs = [middle != each for each in (rows[2 * k :], rows[: -2 * k], columns[:, 2 * k :], columns[:, : -2 * k])]
    uncertain.append(np.mean(np.any(differs, axis=0)))
dimension = 2.0 - np.polyfit(np.log(steps), np.log(uncertain), 1)[0]
print(f"dimension of the boundary {dimension:.2f}")

# %%

figure, (left, right) = plt.subplots(1, 2, figsize=(9.0, 4.0), layout="constrained")
dynamics.bifurcation_diagram(
    shaken,
    np.linspace(1.4, 1.78, 153),
    [0.05, 0.5],
    transient_periods=300,
    parameter="peak acceleration of the table over g",
).plot(left, title="a ball on a table")
left.axvline(doubling, color="C3", linestyle="--", linewidth=0.8)
basins.plot(right, title="a block under a sine")
figure.legend(handles=right.get_legend().legend_handles, loc="outside lower center", ncols=3, frameon=False)
left.get_legend().remove()
right.get_legend().remove()
plt.show()
