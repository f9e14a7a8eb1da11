r"""
A bouncing ball: chattering in closed form
==========================================

A ball that is dropped from the height :math:`h` reaches the table after :math:`t_1 = \sqrt{2h/g}`.
Each flight takes :math:`e` times as long as the one before, so that the ball has bounced infinitely
often, and is at rest, at

.. math:: t_1 + 2 t_1 (e + e^2 + e^3 + \dots) = t_1\,\frac{1 + e}{1 - e} .

The solver knows none of this. It follows impact after impact until it can prove that the rest of them
accumulate, and says between which times.
"""

import matplotlib.pyplot as plt
import numpy as np

from rocking import dynamics

e, g, h = 0.8, 9.80665, 1.0
ball = dynamics.BouncingBall(restitution=e, gravity=g)
response = dynamics.simulate(ball, None, initial_position=h)

rest = response.sequences[0]
closed_form = np.sqrt(2.0 * h / g) * (1.0 + e) / (1.0 - e)
difference = rest["end"] - closed_form
resolved = len(response.impacts)
print(f"at rest at {rest['end']:.12f} s; in closed form {closed_form:.12f} s")
print(f"proven from {rest['start']:.3f} s on, after {resolved} impacts")

# %%
# Near the rest the flights look alike: the :math:`n`-th one is :math:`e^{2n} h` high, and at its top the
# time that is left has shrunk by :math:`e^n`. So all tops lie on a parabola about the time of rest.

left = closed_form - response.impacts["time"]
n = np.arange(len(left))
similar = left / (left[0] * e**n)

figure, (above, below) = plt.subplots(1, 2, figsize=(7.5, 3.2), layout="constrained", width_ratios=(2, 1))
time = closed_form - np.geomspace(closed_form, 1e-2, 4000)
above.plot(time, response.position(time), "k-")
above.plot(response.impacts["time"], 0.0 * left, "ko", markerfacecolor="white", label="impacts that are followed")
above.axvline(closed_form, color="C3", linestyle="--", label=r"$t_1\,(1 + e)/(1 - e)$")
above.set(xlabel="time (s)", ylabel="height (m)")
above.legend(frameon=False)
below.loglog(closed_form - time, response.position(time), "k-")
below.loglog(closed_form - time, h * ((closed_form - time) / closed_form) ** 2, "C3--", label="(time left)²")
below.set(xlabel="time left to rest (s)", ylabel="height (m)", ylim=(1e-6, 2.0))
below.invert_xaxis()
below.legend(frameon=False)
plt.show()
