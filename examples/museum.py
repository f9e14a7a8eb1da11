"""
A museum piece under the Ridgecrest earthquake
==============================================

A slender piece, 0.24 m wide and 1.10 m high, stands on the floor of its showcase. The ground moves
as China Lake did on 6 July 2019, at magnitude 7.1. Does it fall, how far does it turn, when is it at
rest again, and does the model hold?
"""

import matplotlib.pyplot as plt

import rocking

piece = rocking.Block(width=0.24, height=1.10)
motion = rocking.records.load("ridgecrest-clc-090")
response = rocking.simulate(piece, motion)

# %%
# The summary says it all in words. The block does not slide if the friction is as large as it says,
# and does not leave the ground, as the least normal force is above zero.

print(response.summary())

# %%
# The piece comes to rest six times while the ground goes on moving, each time by infinitely many
# impacts in a finite time. A proof closes each of these sequences, with a bracket on the time of rest.

peak, last = response.peak_over_slenderness, response.sequences[-1]
rests, bracket = len(response.sequences), last["upper"] - last["lower"]
print(f"it turns by {peak:.4f} of its slenderness at most, and rests {rests} times,")
print(f"the last time at {last['end']:.4f} s; the bracket is {bracket:.0e} s wide")

# %%

response.plot(longest_sequence=True)
plt.show()
