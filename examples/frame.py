r"""
A rocking frame
===============

The columns of an ancient temple stand free and carry an architrave, which rests on them as freely.
Makris and Vassiliou (2013) found that the frame rocks as one block with the columns' slenderness and
a half diagonal of

.. math:: R' = R\,\frac{1 + 3\gamma}{1 + 2\gamma} ,

where :math:`\gamma` is the mass of the beam over that of the columns. So a heavy roof makes the frame
harder to overturn, although it is on top.
"""

import matplotlib.pyplot as plt
import numpy as np

import rocking

ratios = (0.0, 1.0, 4.0)
frames = [rocking.Block.from_frame(half_width=0.5, half_height=3.0, mass_ratio=gamma) for gamma in ratios]
larger = [frame.radius / frames[0].radius for frame in frames]
for gamma, frame, growth in zip(ratios, frames, larger, strict=True):
    print(f"gamma = {gamma:g}: R'/R = {growth:.4f}, restitution {frame.restitution:.4f}")

# %%
# The lowest amplitude of a one-sine pulse that overturns each frame, against the pulse's frequency:

frequencies = np.linspace(0.2, 1.6, 29)  # Hz
lowest = []
for frame in frames:
    found = rocking.overturning_map(
        frame,
        "one-sine",
        amplitudes=np.linspace(1.0, 20.0, 77),
        frequencies=2.0 * np.pi * frequencies / frame.p,
        rtol=1e-6,
    )
    lowest.append(found.data.overturning_amplitude.values * np.tan(frame.alpha))  # g
at_one = [float(np.interp(1.0, frequencies, amplitude)) for amplitude in lowest]
print("a pulse of 1 Hz overturns them from", ", ".join(f"{amplitude:.3f} g" for amplitude in at_one), "on")

# %%

figure, axes = plt.subplots(figsize=(6.0, 3.6), layout="constrained")
for gamma, amplitude, style in zip(ratios, lowest, ("k-", "k--", "C3-."), strict=True):
    axes.plot(frequencies, amplitude, style, label=f"γ = {gamma:g}" if gamma else "a column alone")
axes.set(xlabel="frequency of the pulse (Hz)", ylabel="lowest amplitude that overturns (g)", ylim=(0.0, None))
axes.legend(frameon=False)
plt.show()
