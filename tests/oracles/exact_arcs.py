"""Linear bodies under a sine in multi-precision: arcs in closed form, impacts by bisection and secant.

The motion is ``a sin(2 pi f t)``. A body is its law (stiffness, damping, pull, low, high), with jumps of the velocity
at the stops; a block has a law on each side, and changes it at zero.
"""

from dataclasses import dataclass

import mpmath as mp

STEPS = 400
"""Looks per period of the motion for the end of an arc."""


@dataclass(frozen=True)
class Sine:
    """Acceleration of what shakes the body."""

    amplitude: float
    frequency: float

    @property
    def rate(self):
        return 2 * mp.pi * mp.mpf(self.frequency)


def arc(stiffness, damping, pull, push, sine, start, x, v):
    """Position and velocity as functions of time of x'' = stiffness x - damping x' - pull - push sin(rate t)."""
    k, d, g = (mp.mpf(each) for each in (stiffness, damping, pull))
    w, a = sine.rate, mp.mpf(push) * mp.mpf(sine.amplitude)
    # Forced part c sin + s cos; a constant, or of a ball a parabola.
    p = -w * w - k
    c, s = -a * p / (p * p + d * d * w * w), a * d * w / (p * p + d * d * w * w)

    def forced(t):
        return c * mp.sin(w * t) + s * mp.cos(w * t), w * (c * mp.cos(w * t) - s * mp.sin(w * t))

    at, rate = forced(start)
    if k == 0:
        y, u = x - at, v - rate

        def state(t):
            h, (f, r) = t - start, forced(t)
            return y + u * h - g * h * h / 2 + f, u - g * h + r

        return state
    root = mp.sqrt(mp.mpc(d * d / 4 + k))
    first, second = -d / 2 + root, -d / 2 - root
    y, u = x - at - g / k, v - rate
    left = (u - second * y) / (first - second)
    right = y - left

    def state(t):
        h, (f, r) = t - start, forced(t)
        one, two = left * mp.exp(first * h), right * mp.exp(second * h)
        return mp.re(one + two) + g / k + f, mp.re(first * one + second * two) + r

    return state


def root_of(function, low, high):
    """Root of a function that changes its sign once, to working precision."""
    sign = mp.sign(function(low))
    for _ in range(40):
        middle = (low + high) / 2
        low, high = (middle, high) if mp.sign(function(middle)) == sign else (low, middle)
    return mp.findroot(function, (low, high), solver="secant", tol=mp.mpf(10) ** (-2 * mp.mp.dps + 10))


def followed(body, sine, state, periods, gravity=None):
    """State after some periods, and the number of impacts; a body is (law, restitution), or (p, alpha, restitution)."""
    x, v = (mp.mpf(each) for each in state)
    end, time, impacts = mp.mpf(periods) / mp.mpf(sine.frequency), mp.mpf(0), 0
    step = 1 / (mp.mpf(sine.frequency) * STEPS)
    is_block = len(body) == 3
    side = 1 if x > 0 or (x == 0 and v > 0) else -1
    while True:
        if is_block:
            p, alpha, e = (mp.mpf(each) for each in body)
            law = (p * p, 0, side * p * p * alpha, 0, 0)
            course = arc(*law[:3], p * p / mp.mpf(gravity), sine, time, x, v)
            gaps = [lambda t, f=course, side=side: side * f(t)[0]]
        else:
            law, e = body
            course = arc(*law[:3], 1, sine, time, x, v)
            gaps = [lambda t, f=course, low=law[3]: f(t)[0] - mp.mpf(low)]
            if mp.isfinite(law[4]):
                gaps.append(lambda t, f=course, high=law[4]: mp.mpf(high) - f(t)[0])
        before, hit = time + step / 1000, None
        while hit is None and before < end:
            after = min(before + step, end)
            for gap in gaps:
                if gap(after) < 0:
                    hit = root_of(gap, before, after)
            before = after
        if hit is None:
            return course(end), impacts
        _, speed = course(hit)
        x, v, time, impacts = course(hit)[0], (mp.mpf(e) * speed if is_block else -mp.mpf(e) * speed), hit, impacts + 1
        side = -side


def derivative(body, sine, state, periods, gravity=None):
    """Derivative of the state after some periods by that before, by central differences in 40 digits."""
    with mp.workdps(40):
        h = mp.mpf(10) ** -13
        columns = []
        for k in range(2):
            ends = []
            for sign in (1, -1):
                moved = [mp.mpf(each) for each in state]
                moved[k] += sign * h
                ends.append(followed(body, sine, moved, periods, gravity)[0])
            columns.append([(a - b) / (2 * h) for a, b in zip(*ends, strict=True)])
        return mp.matrix(columns).T
