r"""
How the median of a fragility changes with the block
====================================================

The critical scale of a motion is the one at which the block begins to overturn. A lognormal fragility can be
fitted to these scales, one of each motion: its median is the exponential of their mean logarithm. Since
``rocking.critical_scale`` has derivatives by the block's parameters, so has the median.
"""

import matplotlib.pyplot as plt
import numpy as np

import rocking

block = rocking.Block.from_parameters(p=2.0, alpha=0.2, restitution=0.9)
motions = [rocking.pulses.one_sine(1.0, frequency) for frequency in np.linspace(0.4, 1.0, 13)]


def capacities(body):
    """Peak accelerations, m/s^2, at which a body begins to overturn, and their relative derivatives."""
    found = [rocking.critical_scale(body, motion, (1.0, 12.0)) for motion in motions]
    by = {
        name: np.array([getattr(each, f"{name}_derivative") / each.scale for each in found])
        for name in ("p", "alpha", "restitution")
    }
    return np.array([each.scale for each in found]), by


levels, by = capacities(block)
median, dispersion = np.exp(np.log(levels).mean()), np.log(levels).std(ddof=1)
changes = {name: median * each.mean() for name, each in by.items()}
print(f"median {median:.4f} m/s^2, dispersion {dispersion:.4f}")
for name, change in changes.items():
    print(f"1 % more of {name} changes the median by {0.01 * change:+.4f} m/s^2")

# %%
# A simulation of a block with a slenderness that is 1 % larger confirms the derivative:

wider, _ = capacities(rocking.Block.from_parameters(p=2.0, alpha=0.202, restitution=0.9))
difference = np.exp(np.log(wider).mean()) - median
print(f"simulated: {difference:+.4f} m/s^2")

plt.figure(figsize=(5.4, 3.4), layout="constrained")
frequencies = np.linspace(0.4, 1.0, 13)
for name, each in by.items():
    plt.plot(frequencies, each, "o-", label=name)
plt.axhline(0.0, color="k", linewidth=0.6)
plt.gca().set(xlabel="frequency of the pulse (Hz)", ylabel="relative change of the level per relative change")
plt.legend(frameon=False)
plt.show()
