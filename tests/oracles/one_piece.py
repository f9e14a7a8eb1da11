"""Chattering within one smooth piece of the motion, on one side or two, for a stiffness of any sign."""

from typing import Any

from mpmath import MPContext

mp = MPContext()
mp.dps = 60
Number = Any

SETTLED = mp.mpf("1e-26")
"""Relative change of the extrapolated rest time at which it is taken."""

Half = tuple[float, float, float, float, float]
"""g, rate, curvature, stiffness, restitution."""


def stumpff(q: Number, first: int) -> Number:
    """Sum of q^k / (2 k + first)!."""
    term = 1 / mp.factorial(first)
    total, k = term, 0
    while abs(term) > mp.mpf("1e-58"):
        k += 1
        term *= q / ((2 * k + first) * (2 * k + first - 1))
        total += term
    return total


def arc(v: Number, t: Number, side: Half) -> tuple[Number, Number]:
    """Duration and impact speed of an arc from time t under g + rate t + curvature t^2 - stiffness u."""
    g, rate, bend, k, _ = (mp.mpf(x) for x in side)
    g, rate = g + t * (rate + t * bend), rate + 2 * t * bend
    tau = 2 * v / g
    for _ in range(60):
        c = [stumpff(k * tau * tau, n) for n in range(5)]
        height = tau * (v * c[1] - tau * (g * c[2] + tau * (rate * c[3] + 2 * tau * bend * c[4])))
        slope = v * c[0] - tau * (g * c[1] + tau * (rate * c[2] + 2 * tau * bend * c[3]))
        step = height / slope
        tau -= step
        if abs(step) < abs(tau) * mp.mpf("1e-50"):
            return tau, -slope
    raise AssertionError("an arc that does not end")


def rest_time(v: float, sides: tuple[Half, Half], most_pairs: int = 60) -> Number:
    """Time to rest: that of every second impact, with one power of the restitution's product removed after another."""
    pair = mp.mpf(sides[0][4]) * mp.mpf(sides[1][4])
    time, speed = mp.mpf(0), mp.mpf(v)
    row = [time]
    for _ in range(most_pairs):
        for side in sides:
            tau, w = arc(speed, time, side)
            time, speed = time + tau, mp.mpf(side[4]) * w
        previous, row = row, [time]
        power = mp.mpf(1)
        for older in previous:
            power *= pair
            row.append((row[-1] - power * older) / (1 - power))
        if len(row) > 5 and max(abs(row[k] - row[k - 1]) for k in (-1, -2)) < SETTLED * row[-1]:
            return row[-1]
    raise AssertionError("the rest time does not settle")
