r"""
Which law of restitution explains a free-rocking test
=====================================================

Between two impacts a free block keeps its energy. In the linear model the time :math:`T` between them
therefore gives the speed :math:`p\alpha\tanh(pT/2)`, and the ratio of two such speeds is the restitution at
the impact between them. Three laws are compared by Schwarz's criterion.
"""

import matplotlib.pyplot as plt
import numpy as np
from scipy.optimize import least_squares

import rocking

block = rocking.Block(width=0.4, height=2.0)
worn = rocking.RestrainedBlock(block, restitution=rocking.Restitution(0.96, 0.7, slope=0.15))
timing, noise = 1e-3, np.random.default_rng(1)  # standard deviation of the error of a time, s
speeds, factors, roots = [], [], []
for rotation in (0.08, 0.12, 0.16):
    response = rocking.simulate(worn, None, initial_rotation=rotation, model="linear")
    phase = 0.5 * block.p * np.diff(response.impacts["time"][:12] + noise.normal(0.0, timing, 12))
    speed = block.p * block.alpha * np.tanh(phase)
    # An error of a time enters two neighbouring factors, whose errors are therefore correlated.
    by_time = (block.p / np.sinh(2.0 * phase))[:, None] * (np.eye(11, 12, 1) - np.eye(11, 12))
    roots.append(np.linalg.cholesky(timing**2 * np.diff(by_time, axis=0) @ np.diff(by_time, axis=0).T))
    speeds.append(speed[:-1])
    factors.append(speed[1:] / speed[:-1])

# %%
# Each law is fitted to the logarithms of the factors, with the errors of the times made independent.

laws: dict = {
    "Housner": (lambda w: np.full(w.shape, block.restitution), []),
    "constant": (lambda w, e: np.full(w.shape, e), [0.9]),
    "falling with the speed": (lambda w, e, slope: e - slope * w, [0.9, 0.1]),
}
criteria, fits = {}, {}
for name, (law, start) in laws.items():

    def residuals(x, law=law):
        """Residuals of a law over their standard errors."""
        tests = zip(roots, factors, speeds, strict=True)
        return np.concatenate([np.linalg.solve(root, np.log(e / law(w, *x))) for root, e, w in tests])

    fits[name] = least_squares(residuals, start).x if start else np.array([])
    criteria[name] = np.sum(residuals(fits[name]) ** 2) + len(start) * np.log(sum(map(len, factors)))
slope = fits["falling with the speed"][1]
for name, criterion in criteria.items():
    print(f"{name}: criterion {criterion - min(criteria.values()):.0f} above the least")
print(f"slope {slope:.3f} s/rad; the hidden block has 0.15 s/rad")

at = np.linspace(0.0, 0.6)
plt.figure(figsize=(5.4, 3.4), layout="constrained")
plt.plot(np.concatenate(speeds), np.concatenate(factors), "ko", mfc="white", label="from the times of impacts")
for name, style in zip(laws, ("C0--", "C1:", "k-"), strict=True):
    plt.plot(at, laws[name][0](at, *fits[name]), style, label=name)
plt.gca().set(xlabel="speed before the impact (rad/s)", ylabel="restitution", ylim=(0.85, 1.0))
plt.legend()
plt.show()
