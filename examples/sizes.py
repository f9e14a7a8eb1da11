r"""
Why large blocks stand
======================

A rocking spectrum is the peak rotation of blocks of one shape against their size. Once a block is so
large that its rotation is small beside its slenderness, its displacement :math:`R\theta` no longer
depends on the size: the rotation goes as :math:`1/R`.
"""

import matplotlib.pyplot as plt
import numpy as np

import rocking

names = [name for name in rocking.records.names() if not name.endswith("up")]
motions = [rocking.records.load(name).scaled_to(0.5, "pgv") for name in names]

sizes = np.geomspace(20.0, 160.0, 16)  # half diagonal, m
large = rocking.rocking_spectrum(rocking.Blocks.grid(alpha=[0.1], size=sizes), motions)
exponents = [np.polyfit(np.log(sizes), np.log(peaks), 1)[0] for peaks in large.data.peak_rotation.values[:, 0]]
exponent = np.median(exponents)
print(f"peak rotation goes as R^{exponent:.3f}, in the median of {len(motions)} records")

# %%
# Smaller blocks overturn under some of the records, scaled here to a PGV of 0.5 m/s:

blocks = rocking.Blocks.grid(alpha=[0.1, 0.2], size=np.geomspace(0.3, 60.0, 48))
spectrum = rocking.rocking_spectrum(blocks, motions)
largest = spectrum.data["size"].where(spectrum.data.overturned_share > 0.0).max("p").values
for alpha, size in zip((0.1, 0.2), largest, strict=True):
    print(f"slenderness {alpha:g}: the largest block that some record overturns has R = {size:.2f} m")

spectrum.plot(abscissa="size", title="Six records scaled to a PGV of 0.5 m/s")
plt.show()
