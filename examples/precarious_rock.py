"""
A precarious rock and its hazard
================================

A rock of two tonnes, which 20 degrees would tip over, has stood for ten thousand years. How often does
a motion come that overturns it, if the hazard curve of its site is right? And can the curve be right?
"""

import matplotlib.pyplot as plt
import numpy as np

import rocking

# %%
# The rock's size follows from its mass and density, for a block on a square base:

alpha, mass, density = np.radians(20.0), 2000.0, 2650.0  # rad, kg, kg/m^3
height = (mass / density / np.tan(alpha) ** 2) ** (1 / 3)
rock = rocking.Block(width=height * np.tan(alpha), height=height)

# %%
# Six horizontal records that ship with the package, each scaled to forty levels of peak ground
# velocity, give its fragility, the probability :math:`P(x)` that a motion of the velocity :math:`x`
# overturns it:

names = [name for name in rocking.records.names() if not name.endswith("up")]
motions = [rocking.records.load(name) for name in names]
fragility = rocking.fragility(rock, motions, measure="pgv", levels=np.linspace(0.1, 4.0, 40))
median = fragility.curve("overturning").median
print(f"even odds at a PGV of {median:.3f} m/s")

# %%
# The hazard curve is an example and belongs to no real site: how often a year the ground exceeds each
# velocity. With it the annual rate of overturning is :math:`\int \lambda(x)\,dP(x)`.

velocity = np.array([0.05, 0.1, 0.2, 0.5, 1.0, 2.0])  # m/s
exceeded = np.array([2e-2, 8e-3, 3e-3, 6e-4, 1e-4, 1e-5])  # times a year
site = rocking.HazardCurve(velocity, exceeded, measure=rocking.Measure("pgv"))
rate = fragility.annual_rate(site).rate("overturning")
years = rate.return_period
print(f"overturns {rate.describe_period()}")

# %%
# What the age of the rock says: an intensity that has most likely never come, and whether the hazard
# curve lets the rock stand for so long.

stood = fragility.survival(10_000.0, site)
never, chance = stood.never_reached_intensity, stood.probability
print(f"most likely never a PGV of {never:.2f} m/s or more")
print(f"the chance to stand for 10,000 years under this hazard is {chance:.2f}")

# %%

stood.plot(title="How often at most, if the rock has stood for 10,000 years")
plt.show()
