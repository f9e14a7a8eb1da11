"""Other systems of the same engine: a ball on a table that moves, and an oscillator with a stop."""

import math

import mpmath
import numpy as np
import pytest
from kernel_structs import NO_GROUND, ULP, in_units_of_g, one_sided, rules_for, state_of
from test_kernels_march import Run, run

from rocking.kernels import state
from rocking.kernels.certificate import Proof, prove_rest
from rocking.kernels.ground import Ground
from rocking.kernels.state import Struct, create_scratch
from rocking.kernels.uplift import find_next_uplift

pytestmark = pytest.mark.usefixtures("parts_run_by_python")

G = 9.81

mp = mpmath.mp.clone()
mp.dps = 40


def ball(e: float) -> Struct:
    """u'' = -(g + table's acceleration)."""
    return one_sided(0.0, G, 1.0, e)


def sine_table(amplitude: float, frequency: float, duration: float, width: float) -> Ground:
    """Table's acceleration amplitude sin(omega t), g: Taylor polynomials on short pieces, good to double precision."""
    omega, starts = 2.0 * math.pi * frequency, np.arange(0.0, duration, width)
    rows = []
    for t in starts:
        cycle = [math.sin(omega * t), math.cos(omega * t), -math.sin(omega * t), -math.cos(omega * t)]
        rows.append([amplitude * cycle[k % 4] * omega**k / math.factorial(k) for k in range(14)])
    return in_units_of_g([*starts, starts[-1] + width], rows)


def thrown(ground: Ground, block: Struct, v: float, u: float = 0.0, **rules: float) -> Run:
    return run(ground, block=block, velocity=v, rotation=u, **rules)


@pytest.mark.parametrize("e", [0.1, 0.5, 0.9, 0.99])
@pytest.mark.parametrize("v", [1e-6, 1.0, 30.0])
@pytest.mark.parametrize("columns", [2, 4])
def test_a_ball_on_a_table_at_rest_stops_bouncing_at_zenos_time(e: float, v: float, columns: int) -> None:
    """The sum of 2 v e^n/g; that of the speeds is geometric, too, and the certificate's bracket holds it."""
    ground = in_units_of_g([0.0, 1e3], [[0.0] * columns])
    found, zeno = thrown(ground, ball(e), v), 2.0 * v / (G * (1.0 - e))
    assert found.kinds == [state.EventKind.REST]
    assert found.events["time"][0] == pytest.approx(zeno, rel=1e-13, abs=1e-12)
    (sequence,) = found.sequences
    assert sequence["lower"] <= zeno * (1.0 + 1e-14)
    assert zeno <= sequence["upper"] * (1.0 + 1e-14)
    rounding = 32.0 * ULP * (len(found.impacts) + 5) * zeno
    assert sequence["upper"] - sequence["lower"] <= max(1e-12, rounding)
    assert np.all(found.impacts["side"] == 1)
    speeds = v * e ** np.arange(len(found.impacts))
    assert found.impacts["speed_before"] == pytest.approx(speeds, rel=1e-13)
    assert found.at["peak"] == pytest.approx(v * v / (2.0 * G), rel=1e-14)
    assert found.at["peak_time"] == pytest.approx(v / G, rel=1e-14)


@pytest.mark.parametrize("e", [0.1, 0.5, 0.9, 0.99])
def test_a_geometric_bypass_is_exact_for_a_ball_on_a_table_at_rest(e: float) -> None:
    made = ball(e)
    made["rest_limit"] = 0.05
    found, zeno = thrown(NO_GROUND, made, 1.0, rest_rule=state.RestRule.BYPASS), 2.0 / (G * (1.0 - e))
    assert found.impacts["speed_after"][-2] > 0.05 >= found.impacts["speed_after"][-1]
    assert found.events["time"] == pytest.approx([zeno], rel=1e-13)
    assert np.isnan(found.sequences["upper"]).all()


def test_a_geometric_bypass_waits_until_the_motion_presses_the_ball_down() -> None:
    made = ball(0.5)
    made["rest_limit"] = 1e9
    table = in_units_of_g([0.0, 0.1], [[-1.5, 0.0]])
    found = thrown(table, made, 0.0, rest_rule=state.RestRule.BYPASS)
    start, v = 0.1, 0.5 * G * 0.1  # the table falls away and stops, and the ball comes down on it
    u = 0.25 * G * 0.1 * 0.1
    speed = 0.5 * math.sqrt(v * v + 2.0 * G * u)
    struck = start + (v + 2.0 * speed) / G
    assert found.impacts["time"] == pytest.approx([struck], rel=1e-13)
    assert found.events["time"][1:] == pytest.approx([struck + 4.0 * speed / G], rel=1e-13)


def test_a_ball_without_any_motion_of_the_table_needs_no_piece_of_it() -> None:
    for u in (0.0, 1.0):
        found = thrown(NO_GROUND, ball(0.5), 1.0, u)
        first = (1.0 + math.sqrt(1.0 + 2.0 * G * u)) / G
        speed = math.sqrt(1.0 + 2.0 * G * u)
        assert found.status == state.MarchStatus.DONE
        assert found.impacts["time"][0] == pytest.approx(first, rel=1e-14)
        assert found.events["time"][-1] == pytest.approx(first + 2.0 * 0.5 * speed / (G * 0.5), rel=1e-13)


def test_a_ball_may_be_in_the_air_when_the_motion_of_the_table_is_over() -> None:
    found = thrown(in_units_of_g([0.0, 0.1], [[0.3, 0.0]]), ball(0.5), 1.0)
    u, v = 0.1 - 0.5 * 1.3 * G * 0.01, 1.0 - 1.3 * G * 0.1
    flight = (v + math.sqrt(v * v + 2.0 * G * u)) / G
    assert found.impacts["time"][0] == pytest.approx(0.1 + flight, rel=1e-14)


def test_a_table_that_falls_away_faster_than_the_ball_lets_it_fly() -> None:
    """At rest until the table's acceleration passes -g, and then up by what it falls more."""
    ground = in_units_of_g([0.0, 1.0, 1.2, 9.0], [[0.0, -0.5], [-2.0, 0.0], [0.0, 0.0]])
    found = thrown(ground, ball(0.5), 0.0)
    assert found.kinds == [state.EventKind.UPLIFT, state.EventKind.REST]
    assert found.events["time"][0] == 1.0
    assert found.events["side"][0] == 1
    v, u = G * 0.2, 0.5 * G * 0.04
    flight = (v + math.sqrt(v * v + 2.0 * G * u)) / G
    assert found.impacts["time"][0] == pytest.approx(1.2 + flight, rel=1e-13)


# ---- An oscillator with a stop: u'' = -omega^2 u - pressed (threshold + a) ----

OMEGA = 3.0


def oscillator(e: float, pressed: float = 1.0) -> Struct:
    """Pressed against its stop by a constant force."""
    return one_sided(-OMEGA * OMEGA, pressed, 1.0, e)


def return_time(v: float, pressed: float = 1.0) -> float:
    """From the stop and back: u = (v/omega) sin(omega t) - (pressed/omega^2)(1 - cos(omega t))."""
    return 2.0 / OMEGA * math.atan(OMEGA * v / pressed)


@pytest.mark.parametrize("e", [0.3, 0.9])
@pytest.mark.parametrize("v", [1e-4, 0.1, 3.0, 100.0])
@pytest.mark.parametrize("columns", [2, 3])
def test_an_oscillator_returns_to_its_stop_as_in_closed_form(e: float, v: float, columns: int) -> None:
    """The speed at the stop is kept but for restitution, so that the sum of the flights is the time to rest."""
    found = thrown(in_units_of_g([0.0, 1e3], [[0.0] * columns]), oscillator(e), v)
    speeds = v * e ** np.arange(2000.0)
    times = np.cumsum([return_time(s) for s in speeds])
    count = len(found.impacts)
    assert found.impacts["time"] == pytest.approx(times[:count], rel=1e-12)
    assert found.impacts["speed_before"] == pytest.approx(speeds[:count], rel=1e-11)
    assert found.kinds == [state.EventKind.REST]
    assert found.events["time"][0] == pytest.approx(times[-1], abs=2e-12)
    (sequence,) = found.sequences
    assert sequence["lower"] - 1e-13 <= times[-1] <= sequence["upper"] + 1e-13
    top = math.hypot(v / OMEGA, 1.0 / OMEGA**2) - 1.0 / OMEGA**2
    assert found.at["peak"] == pytest.approx(top, rel=1e-13)


@pytest.mark.parametrize(
    "make, exact", [(ball, lambda v: 2.0 * v / G), (oscillator, return_time)], ids=["ball", "oscillator"]
)
@pytest.mark.parametrize("tolerance", [math.inf, 0.0], ids=["by comparison", "of higher order"])
def test_the_bracket_of_a_body_that_bounces_on_one_side_holds_its_rest(make, exact, tolerance: float) -> None:
    for e in (0.2, 0.9):
        for v in (1e-6, 1e-3, 0.05):
            found: Proof = prove_rest(
                in_units_of_g([0.0, 1e3], [[0.0, 0.0]]), make(e), rules_for(tolerance=tolerance), create_scratch(),
                state_of(0, 0.0, v),
            )  # fmt: skip
            rest = math.fsum(exact(v * e**n) for n in range(2000))
            assert found.lower <= rest * (1.0 + 1e-15)
            assert rest <= found.upper * (1.0 + 1e-15)
            assert found.lower <= found.time <= found.upper
            if tolerance == 0.0 and v < 1e-2:
                assert found.upper - found.lower <= 1e-9 * rest


def test_a_march_of_a_ball_without_a_table_of_rows_is_the_same() -> None:
    ground = sine_table(0.4, 3.0, 3.0, 0.02)
    kept, alone = thrown(ground, ball(0.9), 0.5), run(ground, block=ball(0.9), velocity=0.5, rows=0, keep=False)
    for name in ("peak", "peak_time", "impact_count", "rest_count", "last_rest_time", "end_time"):
        assert kept.at[name] == alone.at[name]


@pytest.mark.thorough
def test_what_has_one_side_is_lifted_to_no_other() -> None:
    """Whatever pushes the other way as it lifts off: a spring that is pressed, or a weight that is gone."""
    for body, ground in (
        (one_sided(0.0, 1.0, -0.1, 0.5), in_units_of_g([0.0, 1.0], [[0.05, 0.0]])),
        (one_sided(0.0, 1.0, 1.0, 0.5), in_units_of_g([0.0, 1.0], [[0.05, 0.0]], vertical=[[-2.0, 0.0]])),
    ):
        assert find_next_uplift(ground, body, create_scratch(), state.AT_REST, 0, 0.0, math.inf).side == 0
