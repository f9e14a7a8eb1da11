"""The Taylor series of an arc in 60 digits, by the equation of motion: the one reference for all recurrences."""

from collections.abc import Sequence
from typing import Any, NamedTuple

from mpmath import MPContext

mp = MPContext()
mp.dps = 60
NEGLIGIBLE = mp.mpf("1e-50")
ORDER = 64
Number = Any
Line = tuple[float, float]


class System(NamedTuple):
    """Stiffness, gain and threshold of the linear equation; or (nonlinear) stiffness and slenderness."""

    lam: Number
    alpha: Number
    nonlinear: bool = False
    gain: Number = None

    @property
    def gained(self) -> Number:
        """Gain of the threshold and of the motion: the stiffness where nothing else is given."""
        return mp.mpf(self.lam if self.gain is None else self.gain)


def coefficients(
    system: System,
    u: Number,
    v: Number,
    push: Sequence[Number],
    weight: Sequence[Number] = (1.0,),
    order: int = ORDER,
    *,
    sizes: bool = False,
) -> list[Number]:
    """Coefficients of the rotation up to an order, for a push and a weight that are polynomials in time.

    ``sizes``: the same sums of sizes instead of numbers, of which the rounding of any recurrence is a few ulps.
    """

    def number(x: Number) -> Number:
        return abs(mp.mpf(x)) if sizes else mp.mpf(x)

    minus = 1 if sizes else -1
    a, w = ([number(x) for x in values] for values in (push, weight))
    lam, gain, alpha = number(system.lam), number(system.gained), mp.mpf(system.alpha)
    c = [number(u), number(v)]
    sine, cosine = [number(mp.sin(alpha - u))], [number(mp.cos(alpha - u))]
    for k in range(order - 1):
        here = range(min(k + 1, len(w)))
        if system.nonlinear:
            pull = mp.fsum(w[j] * sine[k - j] for j in here)
            pull += mp.fsum(a[j] * cosine[k - j] for j in range(min(k + 1, len(a))))
            acceleration = minus * lam * pull
            _extend(c, sine, cosine, minus)
        else:
            acceleration = mp.fsum(lam * w[j] * c[k - j] for j in here)
            acceleration += minus * gain * ((w[k] * alpha if k < len(w) else 0) + (a[k] if k < len(a) else 0))
        c.append(acceleration / ((k + 1) * (k + 2)))
    return c


def angles(alpha: float, c: Sequence[Number], order: int) -> tuple[list[Number], list[Number]]:
    """Coefficients of sin and cos(alpha - u), up to an order, from those of the rotation."""
    sine, cosine = [mp.sin(alpha - c[0])], [mp.cos(alpha - c[0])]
    for _ in range(order):
        _extend(c, sine, cosine, -1)
    return sine, cosine


def _extend(c: Sequence[Number], sine: list[Number], cosine: list[Number], minus: int) -> None:
    """Add the next coefficients of sin and cos(alpha - u)."""
    k = len(sine) - 1
    rates = [(j + 1) * c[j + 1] for j in range(k + 1)]
    turned = mp.fsum(rates[j] * sine[k - j] for j in range(k + 1)) / (k + 1)
    sine.append(minus * mp.fsum(rates[j] * cosine[k - j] for j in range(k + 1)) / (k + 1))
    cosine.append(turned)


def after(
    system: System, u: float, v: float, t: float, push: Sequence[float], weight: Sequence[float] = (1.0,)
) -> tuple[Number, Number]:
    """Rotation and velocity after a time that is no more than a few times that of growth."""
    terms = [x * mp.mpf(t) ** k for k, x in enumerate(coefficients(system, u, v, push, weight))]
    assert max(abs(x) for x in terms[-3:]) <= NEGLIGIBLE * max(abs(x) for x in terms)
    return sum(terms), sum(k * x for k, x in enumerate(terms)) / mp.mpf(t)
