"""
A scanned statue
================

A mesh has in it what rocking needs: mass, centre of mass, inertia, and where the body stands. The mesh
here ships with the package: a plinth, a figure of revolution that stands a little to the east on it,
and a head farther off. A script made it; it was measured on no statue.
"""

import matplotlib.pyplot as plt

import rocking

densities = {"plinth": 2700.0, "figure": 2650.0, "head": 2650.0}  # kg/m^3
statue = rocking.Solid.from_mesh("statue", density=densities)
print(f"{statue.mass:.1f} kg, centre of mass {statue.centre[2]:.3f} m above the ground")

# %%
# In the vertical plane of an azimuth the statue is a block on two pivots. To the east it is lifted
# first, since that is where its mass is:

east = statue.block(90.0)
for name, side in zip(("east", "west"), east.sides, strict=True):
    print(f"{name}: p = {side.p:.4f} rad/s, alpha = {side.alpha:.4f} rad, restitution {side.restitution:.4f}")
response = rocking.simulate(east, rocking.records.load("ridgecrest-clc-090").scaled_to(5.0))
peak = response.peak_rotation
print(f"under the Ridgecrest record, scaled to 5 m/s^2, it turns by {peak:.4f} rad at most")

# %%
# The rose has all azimuths: what acceleration of the ground lifts the statue towards each.

rose = statue.rose()
least = rose.data.weakest_acceleration
print(f"the least acceleration that lifts it is {least:.4f} g, towards {rose.data.weakest_azimuth:g} degrees")

# %%

rose.plot()
plt.show()
