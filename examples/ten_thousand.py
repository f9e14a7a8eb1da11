"""
Ten thousand blocks in a second
===============================

A hundred sizes by a hundred slendernesses, all under one record of 57 s: which of these blocks fall?
Each block is followed impact by impact until its rest is proven, as if it were alone. On two shared
cores this took less than half a second of processor time once the kernels were compiled
(``benchmarks/bench_ensemble.py``).
"""

import matplotlib.pyplot as plt
import numpy as np

import rocking

p, alpha = np.linspace(0.8, 6.0, 100), np.linspace(0.15, 0.30, 100)
blocks = rocking.Blocks.grid(p=p, alpha=alpha, restitution=[0.9])
motion = rocking.records.load("el-centro-meloland-270")
found = rocking.simulate_many(blocks, [motion])

overturned = found.overturned.values.reshape(p.size, alpha.size)
ratio = found.peak_rotation.values.reshape(p.size, alpha.size) / alpha
share, impacts = overturned.mean(), int(found.impacts.sum())
print(f"{overturned.size} blocks: {100.0 * share:.2f} % overturn, after {impacts} impacts in all")

# %%
# Large blocks, whose p is small, and stout ones stand:

figure, axes = plt.subplots(figsize=(6.4, 4.0), layout="constrained")
shown = np.ma.masked_where(overturned, ratio)
image = axes.pcolormesh(alpha, p, shown, cmap="cividis", vmin=0.0, vmax=0.6, rasterized=True)
axes.contourf(alpha, p, overturned, [0.5, 1.5], colors="0.85", hatches=["/"])
figure.colorbar(image, label=r"peak rotation $\theta/\alpha$; hatched: overturns")
axes.set(xlabel=r"slenderness $\alpha$ (rad)", ylabel="frequency parameter p (rad/s)")
plt.show()
