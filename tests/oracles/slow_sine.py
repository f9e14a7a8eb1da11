"""The sine problem in as many digits as it takes, for any frequency: growth by exp(pi 10^6) is no overflow here.

Follows the closed form between impacts in the time tau (the paper's Eq. 6), as ``sine_chattering``, but without ball
arithmetic, so that it reaches the limits of slow and fast forcing. What a double could not hold costs exponent here,
and what cancels between growing terms costs digits, which are there.
"""

import mpmath
from mpmath import mpf

#: Digits beyond the smallest arc that is resolved.
_DIGITS = 60

#: What remains, over what has passed and over what is left of half a period, at which a sequence is taken for complete.
_LITTLE = mpf(10) ** -9

_MOST_IMPACTS = 20_000


def rest_time(a, omega, eta, digits=_DIGITS):
    """Time of rest of a sequence, or None where an arc outlasts half a period. ``a`` may hold more than a double."""
    with mpmath.workdps(digits):
        a, omega, eta = mpf(a), mpf(omega), mpf(eta)
        if a <= 1:
            return mpf(0) if a == 1 else None
        phase = mpmath.asin(1 / a)
        half_period = mpmath.pi / omega
        tau, speed, side = mpf(0), mpf(0), -1
        for _ in range(_MOST_IMPACTS):
            arc = _Arc(a, omega, omega * tau + phase, speed, side)
            duration = arc.root(half_period - tau)
            if duration is None:
                return None
            tau += duration
            speed = -eta * arc.speed(duration)
            side = -side
            # One side pulls with less and less as half a period ends, and then not at all.
            pulls = [1 + s * a * mpmath.sin(omega * tau + phase) for s in (side, -side)]
            remaining = 2 * speed * (1 / pulls[0] + eta / pulls[1]) / (1 - eta**2)
            if 0 < remaining < _LITTLE * min(tau, half_period - tau):
                # A geometric sum, to about a billionth of itself: the pulls change by so little until it is over.
                return tau + remaining
        raise AssertionError("too many impacts")


class _Arc:
    """Height u = |phi| after an impact: u'' = u - (1 + side a sin(angle + omega t))."""

    def __init__(self, a, omega, angle, speed, side):
        self.omega, self.angle, self.side = omega, angle, side
        self.amplitude = a / (1 + omega**2)
        forced = side * self.amplitude * mpmath.sin(angle)
        forced_speed = side * self.amplitude * omega * mpmath.cos(angle)
        self.growing = (-1 - forced + speed - forced_speed) / 2
        self.falling = (-1 - forced - speed + forced_speed) / 2
        pull = 1 + side * a * mpmath.sin(angle)
        self.guess = 2 * speed / pull if speed else 4 * mpmath.sqrt(a**2 - 1) / omega

    def height(self, t):
        """Height at t."""
        forced = self.side * self.amplitude * mpmath.sin(self.angle + self.omega * t)
        return self.growing * mpmath.exp(t) + self.falling * mpmath.exp(-t) + 1 + forced

    def speed(self, t):
        """Rate of the height at t."""
        forced = self.side * self.amplitude * self.omega * mpmath.cos(self.angle + self.omega * t)
        return self.growing * mpmath.exp(t) - self.falling * mpmath.exp(-t) + forced

    def root(self, left):
        """Duration, or None where the arc outlasts ``left``; its height changes sign once (both sides pull back)."""
        if self.height(left) >= 0:
            return None
        low, high = mpf(0), left
        t = self.guess if 0 < self.guess < left else left / 2
        for step in range(2000):
            height = self.height(t)
            low, high = (t, high) if height > 0 else (low, t)
            better = t - height / self.speed(t)
            if not low < better < high or step % 4 == 3:
                better = (low + high) / 2
            moved = abs(better - t)
            t = better
            if moved < t * mpf(10) ** (14 - mpmath.mp.dps) or high - low < t * mpf(10) ** (14 - mpmath.mp.dps):
                return t
        raise AssertionError("the root was not found")
