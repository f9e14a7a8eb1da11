"""What the theory pages state of the sine problem, beyond their examples."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import rocking
from rocking.chattering import chattering_sequence, critical_amplitude

FREQUENCIES = st.floats(math.log(0.02), math.log(200.0)).map(math.exp)


@settings(deadline=None, max_examples=60)
@given(omega=FREQUENCIES, eta=st.floats(0.001, 0.99))
def test_two_bounds_hold_for_the_critical_amplitude_at_any_restitution(omega, eta):
    critical = float(critical_amplitude(omega, eta))
    assert critical <= math.hypot(1.0, omega) * (1.0 + 1e-15)
    assert critical < math.hypot(1.0, math.pi / 2.0 - 2.0 / math.pi)


def test_the_bounds_are_reached_in_the_limits():
    assert critical_amplitude(0.05, 0.5) == pytest.approx(math.hypot(1.0, 0.05), abs=1e-9)
    assert critical_amplitude(1e4, 1e-8) == pytest.approx(math.hypot(1.0, math.pi / 2.0 - 2.0 / math.pi), rel=1e-3)


def test_intervals_alternate_about_the_restitution_and_repeat_with_its_square():
    intervals = chattering_sequence(1.03, 2.0, 0.92).impacts["interval"][100:160]
    ratios = intervals[1:] / intervals[:-1]
    assert np.all((ratios[:-1] - 0.92) * (ratios[1:] - 0.92) < 0.0)
    np.testing.assert_allclose(ratios[:-1] * ratios[1:], 0.92**2, rtol=1e-4)


@pytest.mark.parametrize(("a", "eta", "period"), [(1.04049, 0.92, 1.5), (1.09388, 0.75, 1.5)])
def test_a_block_that_rests_above_the_critical_amplitude_rests_in_the_same_rhythm(a, eta, period):
    assert a > critical_amplitude(2.0, eta)
    block = rocking.Block.from_parameters(p=1.0, alpha=0.2, restitution=eta)
    motion = rocking.pulses.sine(a * block.gravity * 0.2, 1.0 / math.pi, cycles=8.0)
    response = rocking.simulate(block, motion, model="linear", duration=motion.duration)
    rests = response.events["time"][response.events["kind"] == "rest"] / math.pi
    assert rests.size == 5
    np.testing.assert_allclose(np.diff(rests), period, rtol=1e-9)
