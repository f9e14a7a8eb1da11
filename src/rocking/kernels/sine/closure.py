"""The phase that remains to rest: its expansion in the speed, extrapolated over successive pairs of impacts."""

from typing import Any, Final

from rocking.kernels.compiled import inlined
from rocking.kernels.remaining import Restoring, remaining_time
from rocking.kernels.sine.arc import State
from rocking.kernels.sine.power_series import PowerSeries

#: Orders of the speed that the expansion of the remaining phase has right.
ORDER: Final = 2

#: Extrapolations above that expansion, and the relative agreement at which their result is taken.
LEVELS: Final = 5
CLOSED: Final = 1e-13

#: One closure and its successive extrapolations, and the factors of these.
Row = tuple[float, float, float, float, float, float]
Weights = tuple[float, float, float, float, float]


@inlined
def remaining_phase(entered: State, delta: float, eta: float) -> float:
    """Remaining phase on entering the second side, to some orders in the speed: `remaining_time`, in phase."""
    V, P, D = entered
    return remaining_time(V, Restoring(2.0 - P, -D, 0.0, delta, eta, 0.0), Restoring(P, D, 0.0, delta, eta, 0.0))


def remaining_series(entered: tuple[PowerSeries, PowerSeries, PowerSeries], delta: float, eta: float) -> PowerSeries:
    """Evaluate the same formula, uncompiled, for a state (V, P, D) of power series."""
    V, P, D = entered
    formula: Any = getattr(remaining_time, "py_func", remaining_time)
    side: Any = Restoring
    remaining: PowerSeries = formula(V, side(2.0 - P, -D, 0.0, delta, eta, 0.0), side(P, D, 0.0, delta, eta, 0.0))
    return remaining


@inlined
def richardson_weights(eta: float) -> Weights:
    """Factors by which extrapolation weighs the change from one pair of impacts to the next.

    With Q = eta^2 the closures of successive pairs err by sums of Q^{kn}, k = ORDER + 1, ORDER + 2, ..., with
    these very ratios at any amplitude, so each column removes one term.
    """
    Q = eta * eta
    q1 = Q * Q * Q
    q2 = q1 * Q
    q3 = q2 * Q
    q4 = q3 * Q
    q5 = q4 * Q
    return q1 / (1.0 - q1), q2 / (1.0 - q2), q3 / (1.0 - q3), q4 / (1.0 - q4), q5 / (1.0 - q5)


@inlined
def extrapolate(T: float, gone: float, weights: Weights, last: Row) -> Row:
    """Add one closure T of the remaining phase to the ``last`` row of Richardson's table; ``gone`` has passed since.

    All of it in remaining, not absolute, phase, so that the amplified rounding stays relative to what remains.
    """
    r1 = T + (T - (last[0] - gone)) * weights[0]
    r2 = r1 + (r1 - (last[1] - gone)) * weights[1]
    r3 = r2 + (r2 - (last[2] - gone)) * weights[2]
    r4 = r3 + (r3 - (last[3] - gone)) * weights[3]
    r5 = r4 + (r4 - (last[4] - gone)) * weights[4]
    return T, r1, r2, r3, r4, r5


@inlined
def agree(row: Row, last: Row, gone: float, x: float) -> bool:
    """Whether the remaining phase is settled: the last extrapolation changed little, and so did the last pair.

    The first alone deceives where Q is small, the second where Q is close to one.
    """
    remaining = row[LEVELS]
    expected = last[LEVELS] - gone
    return (abs(remaining - row[LEVELS - 1]) <= CLOSED * x) & (abs(remaining - expected) <= CLOSED * x)
