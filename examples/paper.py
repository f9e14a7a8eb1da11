r"""
The paper in forty lines
========================

*Chattering: An overlooked peculiarity of rocking motion* asks when a block under a sine comes to rest
by infinitely many impacts, and how long that takes. In its units, with the frequency
:math:`\omega = \omega_g/p`, the amplitude :math:`a = a_g/(g\alpha)` and the restitution :math:`\eta`,
the chattering time :math:`\tau_{ch}` counts from uplift, and below the critical amplitude
:math:`a_{cr}` chattering is complete within half a period of the sine.
"""

import matplotlib.pyplot as plt
import numpy as np

import rocking
from rocking.chattering import chattering_time, critical_amplitude

omega, eta = 2.0, 0.92
half_period = np.pi / omega

# %%
# The chattering time, exactly and by the paper's asymptotic formula, and the critical amplitude,
# exactly and by the paper's fit:

exact, eq65 = (chattering_time(1.03, omega, eta, method=method) for method in ("exact", "asymptotic"))
critical, eq76 = (critical_amplitude(omega, eta, method=method) for method in ("exact", "eq76"))
print(f"chattering time at a = 1.03: {exact:.6f}, by Eq. 65 {eq65:.6f}")
print(f"critical amplitude: {critical:.6f}, by Eq. 76 {eq76:.6f}")

# %%
# So a block rests under :math:`a = 1.03` in each half cycle, and under :math:`a = 1.05` only when the
# sine is over:

block = rocking.Block.from_parameters(p=1.0, alpha=0.2, restitution=eta)


def shaken(a):
    """Simulate the block under two and a half cycles of a sine of this amplitude."""
    sine = rocking.pulses.sine(a * block.gravity * block.alpha, omega * block.p / (2.0 * np.pi), cycles=2.5)
    return rocking.simulate(block, sine, model="linear")


weak, strong = shaken(1.03), shaken(1.05)
rests = [np.sum(response.events["kind"] == "rest") for response in (weak, strong)]
print(f"rests at a = 1.03: {rests[0]}, at a = 1.05: {rests[1]}")

# %%

figure, axes = plt.subplot_mosaic([["time", "critical"], ["rotation", "rotation"]], layout="constrained")
for value, style in ((0.80, ":"), (eta, "-"), (0.96, "--")):
    a = np.linspace(1.0, critical_amplitude(omega, value), 200)
    axes["time"].plot(a, chattering_time(a, omega, value) / half_period, "k" + style, label=f"η = {value:g}")
    w = np.linspace(0.5, 8.0, 40)
    axes["critical"].plot(w, critical_amplitude(w, value), "k" + style)
axes["time"].set(xlabel="amplitude $a$", ylabel=r"chattering time over $T/2$", ylim=(0.0, 1.0))
axes["critical"].set(xlabel=r"frequency $\omega$", ylabel="critical amplitude")
time = np.linspace(0.0, 11.0, 2000)
for response, style, level in ((strong, "C3--", 1.05), (weak, "k-", 1.03)):
    axes["rotation"].plot(time, response.rotation(time) / block.alpha, style, label=f"a = {level:g}")
axes["rotation"].set(xlabel=r"time $\tau$", ylabel=r"rotation $\theta/\alpha$", xlim=(0.0, 11.0))
axes["time"].legend(frameon=False)
axes["rotation"].legend(frameon=False, ncols=2)
plt.show()
