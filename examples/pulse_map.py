r"""
One pulse, and two ways to fall
===============================

A one-sine pulse overturns a slender block in two ways: at once, or after one impact. So a block that
falls under one pulse may stand a stronger one. The boundary of the first way has a closed form (Zhang
and Makris 2001): with the amplitude :math:`A` over :math:`g\alpha` and the frequency :math:`w` over
:math:`p`,

.. math:: \sqrt{A^2 - 1} - A\,e^{-(2\pi - \arcsin(1/A))/w} = w .
"""

import matplotlib.pyplot as plt
import numpy as np
from scipy.optimize import brentq

import rocking

w = np.linspace(1.0, 7.0, 25)


def excess(A, w):
    """Left side of the condition, less the right one."""
    return np.sqrt(A * A - 1.0) - A * np.exp(-(2.0 * np.pi - np.arcsin(1.0 / A)) / w) - w


exact = np.array([brentq(excess, 1.0, 100.0, args=(each,), xtol=1e-14, rtol=1e-15) for each in w])

# %%
# The closed form knows no limit to the rotation. This block is so slender that it is far from
# :math:`\pi/2` when the pulse is over.

slender = rocking.Block.from_parameters(p=2.0, alpha=1e-5, restitution=0.9)
found = rocking.overturning_map(
    slender, "one-sine", amplitudes=np.linspace(0.5, 15.0, 30), frequencies=w, model="linear", rtol=1e-9
)
at_once = found.data.boundary_amplitude.where(found.data.mode_above == 0, drop=True).values
difference = np.max(np.abs(at_once - exact))
print(f"largest difference from the closed form {difference:.0e}")

# %%
# The whole map, of a block that is not so slender, by the nonlinear equation:

block = rocking.Block.from_parameters(p=2.0, alpha=0.2, restitution=0.9)
amplitudes, frequencies = np.linspace(0.5, 15.0, 30), np.linspace(0.4, 9.0, 44)
rocking.overturning_map(block, "one-sine", amplitudes=amplitudes, frequencies=frequencies).plot()
plt.show()
