"""The dimensionless sine problem in 120 digits, for any frequency: growth by exp(pi 10^6) is no overflow here.

Follows the paper's closed form between impacts (Eq. 6) in the time tau itself, without the product's variables, its
series and its root finding. What cancels between growing terms costs digits, which are there: all numbers are Arb's.
"""

import itertools

from flint import arb, ctx

BITS = 400
_SAMPLES = 24
_MOST_IMPACTS = 20_000


def impacts(a, omega, eta, start=None):
    """Time, side entered and speed after each impact, and the arc before it, until an arc outlasts half a period."""
    phase, half_period = (1 / a).asin().mid(), (arb.pi() / omega).mid()
    tau, side, speed = (arb(0), -1, arb(0)) if start is None else (arb(start[0]), start[1], arb(start[2]))
    while (
        duration := (arc := Arc(a, omega, (omega * tau + phase).mid(), speed, side)).root(half_period - tau)
    ) is not None:
        tau, side, before = (tau + duration).mid(), -side, -arc.speed(duration).mid()
        speed = (eta * before).mid()
        yield tau, side, speed, duration, before


def first_impacts(a, omega, eta, count):
    """First ``count`` intervals and the speeds that end them; fewer where an arc outlasts half a period."""
    with ctx.workprec(BITS):
        return [
            (float(duration), float(before))
            for *_, duration, before in itertools.islice(impacts(arb(a), arb(omega), arb(eta)), count)
        ]


def rest_time(a, omega, eta, *, start=None, little=1e-9):
    """Time of rest of a sequence, or None where an arc outlasts half a period. ``a`` may hold more than a double.

    ``start`` = (time, side entered, speed) takes a sequence up at an impact. The impacts are followed until what
    remains is ``little`` of what has passed and of what is left of half a period: it is summed up to such a share.
    """
    with ctx.workprec(BITS):
        a, omega, eta = arb(a).mid(), arb(omega), arb(eta)
        if a <= 1:
            return arb(0) if a == 1 else None
        phase, half_period = (1 / a).asin().mid(), (arb.pi() / omega).mid()
        known = [] if start is None else [(arb(start[0]), start[1], arb(start[2]))]
        for count, (tau, side, speed, *_) in enumerate(itertools.chain(known, impacts(a, omega, eta, start))):
            # One side pulls with less and less as half a period ends, and then not at all.
            here, there = (1 + s * a * (omega * tau + phase).sin() for s in (side, -side))
            remaining = (2 * speed * (1 / here + eta / there) / (1 - eta**2)).mid()
            if remaining > 0 and remaining < little * tau and remaining < little * (half_period - tau):
                return (tau + remaining).mid()
            assert count < _MOST_IMPACTS
        return None


class Arc:
    """Height u = |phi| after an impact: u'' = u - (1 + side a sin(angle + omega t))."""

    def __init__(self, a, omega, angle, speed, side):
        self.omega, self.angle, self.side = omega, angle, side
        self.amplitude = (a / (1 + omega**2)).mid()
        forced, forced_speed = (side * self.amplitude * each for each in (angle.sin(), omega * angle.cos()))
        self.growing = ((-1 - forced + speed - forced_speed) / 2).mid()
        self.falling = ((-1 - forced - speed + forced_speed) / 2).mid()
        self.guess = (2 * speed / (1 + side * a * angle.sin()) if speed > 0 else 4 * (a**2 - 1).sqrt() / omega).mid()

    def height(self, t):
        """Height at t."""
        forced = self.side * self.amplitude * (self.angle + self.omega * t).sin()
        return (self.growing * t.exp() + self.falling * (-t).exp() + 1 + forced).mid()

    def speed(self, t):
        """Rate of the height at t."""
        forced = self.side * self.amplitude * self.omega * (self.angle + self.omega * t).cos()
        return (self.growing * t.exp() - self.falling * (-t).exp() + forced).mid()

    def root(self, left):
        """Duration, or None where the arc outlasts ``left``."""
        left = left.mid()
        root = None if self.height(left) >= 0 else self._bracketed_root(left)
        if root is None or root > 1e-4:
            assert all(self.height((left if root is None else root) * k / _SAMPLES) > 0 for k in range(1, _SAMPLES))
        return root

    def _bracketed_root(self, high):
        low, t = arb(0), self.guess if self.guess > 0 and self.guess < high else high / 2
        for step in range(2000):
            height = self.height(t)
            low, high = (t, high) if height > 0 else (low, t)
            better = (t - height / self.speed(t)).mid()
            # Newton's steps are short where the arc grows by orders of magnitude.
            if not (low < better and better < high) or (step > 12 and step % 4 == 3):
                better = ((low + high) / 2).mid()
            elif abs(better - t) < t * 2.0**-140:
                return better
            t = better
            if high - low < t * 2.0**-300:
                return t
        raise AssertionError("the root was not found")
