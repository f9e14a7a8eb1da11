r"""
How a velocity threshold gets it wrong
======================================

Many programs put a block to rest where an impact leaves it slower than some threshold. The block here
has :math:`p = 1` rad/s, a slenderness :math:`\alpha` of 0.2 and a restitution of 0.92. Four cycles of a
slow sine, of 1.05 times the amplitude that lifts it, overturn it. With a threshold of
:math:`0.05\,p\alpha` it stands.
"""

import matplotlib.pyplot as plt
import numpy as np

import rocking

block = rocking.Block.from_parameters(p=1.0, alpha=0.2, restitution=0.92)
motion = rocking.pulses.sine(1.05 * block.gravity * block.alpha, 0.5 / np.pi, cycles=4)

# %%
# The block does not rest until it overturns: the rests of a response with a threshold are false, and nothing in
# that response says so.

thresholds = np.geomspace(1e-4, 1e-1, 13)
certified = rocking.simulate(block, motion, model="linear")
print(f"certified: {len(certified.sequences)} rests")
responses = [
    rocking.simulate(block, motion, model="linear", chattering=rocking.VelocityThreshold(float(threshold)))
    for threshold in thresholds
]
false_rests = [len(response.sequences) for response in responses]
for threshold, rests in zip(thresholds[::4], false_rests[::4], strict=True):
    print(f"threshold {threshold:.1e}: {rests} false rests")

# %%
# One of the wrong responses beside the right one, and how many rests each threshold makes up:

wrong = rocking.simulate(block, motion, model="linear", chattering=rocking.VelocityThreshold(0.05))
verdicts = [certified.overturned, wrong.overturned]
print(f"overturns: {verdicts[0]}; with a threshold of 0.05 p alpha: {verdicts[1]}")

figure, (history, count) = plt.subplots(1, 2, figsize=(7.5, 3.2), layout="constrained", width_ratios=(2, 1))
for response, style, label in ((wrong, "C3--", r"threshold of $0.05\,p\alpha$"), (certified, "k-", "proven")):
    time = np.linspace(0.0, 14.0, 4000)
    history.plot(time, response.rotation(time) / block.alpha, style, label=label)
history.set(xlabel="time (s)", ylabel=r"rotation $\theta/\alpha$", ylim=(-0.1, 0.1))
history.legend(frameon=False)
count.semilogx(thresholds, false_rests, "ko-")
count.set(xlabel=r"threshold over $p\alpha$", ylabel="rests that do not happen")
plt.show()
