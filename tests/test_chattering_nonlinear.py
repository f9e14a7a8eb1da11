"""What the slender theory costs: the critical amplitude of a nonlinear block."""

import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from rocking import chattering
from rocking.errors import OptionError


def rests_within_half_a_period(a, omega, eta, alpha):
    """Eq. 2 with p = 1 by SciPy, restarted at each impact, until the speed is nothing or half a period is over."""
    phase, half_period = math.asin(1.0 / a), math.pi / omega
    tau, side, speed = 0.0, -1.0, 0.0

    def restoring(height, time, side):
        push = side * a * math.tan(alpha) * math.sin(omega * time + phase)
        return math.sin(alpha - height) + push * math.cos(alpha - height)

    while tau < half_period:
        pull = restoring(0.0, tau, side)
        scale = speed if speed > 0.0 else 1.0
        solution = solve_ivp(
            lambda t, u, tau=tau, side=side: (u[1], -restoring(u[0], tau + t, side)),
            (0.0, half_period),
            (0.0, speed),
            method="DOP853",
            events=_falling_through_zero,
            rtol=1e-12,
            atol=(1e-14 * scale**2, 1e-14 * scale),
            max_step=speed / pull if speed > 0.0 and pull > 0.0 else 0.05,
        )
        tau += solution.t[-1]
        if not solution.t_events[0].size or tau >= half_period:
            return False
        side, speed = -side, -eta * solution.y[1, -1]
        if speed < 1e-9:
            return True
    return False


def _falling_through_zero(t, u):
    return u[0]


_falling_through_zero.terminal, _falling_through_zero.direction = True, -1.0


def test_slender_blocks_approach_the_slender_theory_like_the_square_of_alpha():
    alpha = np.array([0.1, 0.05, 0.025])
    slender = chattering.critical_amplitude(2.0, 0.92)
    cost = slender - chattering.critical_amplitude_nonlinear(2.0, 0.92, alpha)
    assert (cost > 0.0).all()
    assert cost[:-1] / cost[1:] == pytest.approx(4.0, rel=0.01)


@pytest.mark.parametrize(
    ("omega", "eta", "alpha"), [pytest.param(2.0, 0.92, 0.4, marks=pytest.mark.thorough), (0.6, 0.6, 0.6)]
)
def test_both_sides_of_the_critical_amplitude_by_scipy(omega, eta, alpha):
    critical = float(chattering.critical_amplitude_nonlinear(omega, eta, alpha))
    slender = float(chattering.critical_amplitude(omega, eta))
    margin = 0.1 * (slender - critical)
    assert rests_within_half_a_period(critical - margin, omega, eta, alpha)
    assert not rests_within_half_a_period(critical + margin, omega, eta, alpha)


def test_shape_and_ends():
    assert chattering.critical_amplitude_nonlinear([1.0, 2.0], 1.0, [[0.1], [0.2], [0.3]]).tolist() == [[1.0, 1.0]] * 3
    for alpha in (0.0, -0.1, 1.6, np.nan):
        with pytest.raises(OptionError, match="alpha"):
            chattering.critical_amplitude_nonlinear(2.0, 0.92, alpha)
