"""The first arc where it outlasts half a period: its true end, against 120 digits, or none; never zero."""

import json
import math

import pytest
from flint import arb, ctx
from oracles.sine_chattering import BITS, Arc

from rocking.chattering import chattering_report, sequence
from rocking.chattering.duration import first_arc

#: Looks at each half period for the first change of sign.
LOOKS = 40


def first_change_of_sign(a, omega):
    """Time and speed of the first landing in 120 digits, by looking at a dense series of times."""
    with ctx.workprec(BITS):
        a, omega = arb(a), arb(omega)
        arc = Arc(a, omega, (1 / a).asin().mid(), arb(0), -1)
        step = (arb.pi() / omega / LOOKS).mid()
        high = next(k * step for k in range(1, 10_000) if arc.height(k * step) <= 0)
        low = high - step
        for _ in range(120):
            middle = ((low + high) / 2).mid()
            low, high = (middle, high) if arc.height(middle) > 0 else (low, middle)
        return float(high), -float(arc.speed(high))


@pytest.mark.parametrize(
    ("a", "omega"),
    [(1.4, 2.0), (1.5, 2.0), (2.2, 2.0), (2.236, 2.0), (1.05, 0.5), (1.11, 0.5), (5.0, 20.0), (15.0, 20.0), (50.0, 1e3),
     (30.0, 1e6), (1.0 + 1e-7, 1e-3)],
)  # fmt: skip
def test_the_first_arc_ends_where_120_digits_say(a, omega):
    interval, speed = first_change_of_sign(a, omega)
    near = math.exp(interval) * 1e-15  # rounding grows by as much as the arc
    assert first_arc(a, omega) == pytest.approx((interval, speed), rel=5e-15 + 5.0 * near)


def test_where_the_first_arc_ends_within_half_a_period_it_is_that_of_the_sequence():
    for a, omega in [(1.03, 2.0), (1.2, 2.0), (1.3, 30.0), (1.0 + 1e-9, 1.0)]:
        first = sequence(a, omega, 0.9).impacts[0]
        assert first_arc(a, omega) == pytest.approx((first["interval"], first["speed_before"]), rel=2e-14)


def test_a_block_that_does_not_come_down_has_no_first_impact(run):
    assert all(map(math.isnan, first_arc(3.0, 2.0)))
    assert all(map(math.isnan, first_arc(1e200, 2.0)))
    code, out, _ = run("chatter", 3, 2, 0.92)
    assert code == 0
    assert out.count("none, the block does not come down") == 2
    assert json.loads(run("chatter", 3, 2, 0.92, "--json")[1])["first_interval"]["exact"] is None


def test_the_report_tells_the_first_interval_beyond_half_a_period(run):
    code, out, _ = run("chatter", 1.5, 2, 0.92)
    assert code == 0
    assert "1.92228949 exact" in out and "1.03212611 exact" in out
    values = chattering_report(1.5, 2.0, 0.92).to_dict()
    assert (values["first_interval"]["exact"], values["first_impact_speed"]["exact"]) == first_arc(1.5, 2.0)
