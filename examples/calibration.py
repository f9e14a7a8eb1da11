"""
Calibration on a shake table
============================

A specimen is put on a shake table again and again, and each time it overturns or not. What blocks would
have done the same? The tests here are generated, not measured: every test has a block of its own, whose
slenderness is drawn about 0.15, and a one-sine pulse. Half of the tests are kept back.
"""

import matplotlib.pyplot as plt
import numpy as np

import rocking
from rocking.calibration import Scores

rng = np.random.default_rng(7)
p, slenderness, spread = 3.0, 0.15, 0.06
pulses, overturned = [], []
for _ in range(160):
    block = rocking.Block.from_parameters(p=p, alpha=slenderness * np.exp(spread * rng.standard_normal()))
    pulses.append(rocking.pulses.one_sine(rng.uniform(1.0, 8.0), rng.uniform(0.5, 3.0)))
    overturned.append(rocking.simulate(block, pulses[-1], model="linear").overturned)

# %%
# The calibration knows p, from the specimen's size, and that the restitution is Housner's. It finds the
# slenderness, and how much it varies from test to test.

calibration = rocking.calibrate(
    pulses[:80], overturned[:80], model="linear", p=p, restitution="housner", two_sided=False, candidate_count=512
)
found = calibration.estimates["alpha"].median
print(calibration.summary())

# %%
# It predicts the tests that it has not seen:

chances = calibration.predict(pulses[80:])
scores = Scores.from_predictions(chances, np.array(overturned[80:]))
accuracy, brier = scores.accuracy, scores.brier
print(f"{100.0 * accuracy:.1f} % of 80 further tests predicted, Brier score {brier:.3f}")

# %%

calibration.plot()
plt.show()
