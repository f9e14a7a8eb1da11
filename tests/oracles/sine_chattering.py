"""Independent answers to the dimensionless sine problem: 80-digit arithmetic, and proofs in ball arithmetic.

Both follow the paper's closed form between impacts (Eq. 6) in the time tau itself. Neither uses the product's
variables, its series, its root finding, or its argument that every root before half a period is the first.

`multiprecision_sequence` looks for a root by Newton's method inside a bracket and samples the arc before it. `settle`
proves everything: the arc is positive up to its root (Taylor polynomial with remainder, cell by cell), the root is
enclosed by a change of sign, and the infinite rest of the sequence is enclosed by bounds on the restoring
acceleration over the time that it can take.
"""

from dataclasses import dataclass

import mpmath
from flint import arb, arb_poly, ctx

DIGITS = 80
BITS = (200, 400, 800, 1600)
"""Precisions to try: balls of time and speed grow at each impact, so that long sequences need many bits."""

_SAMPLES = 24
_DEEPEST_SPLIT = 40
_MOST_IMPACTS = 3000


# --- multiprecision -------------------------------------------------------------------------------------------


def multiprecision_sequence(a: float, omega: float, eta: float, count: int):
    """First ``count`` intervals and the speeds that end them; fewer where an arc outlasts half a period."""
    with mpmath.workdps(DIGITS):
        a, omega, eta = mpmath.mpf(a), mpmath.mpf(omega), mpmath.mpf(eta)
        phase = mpmath.asin(1 / a)
        tau, velocity, side = mpmath.mpf(0), mpmath.mpf(0), -1
        intervals, speeds = [], []
        while len(intervals) < count:
            arc = _Arc(a, omega, phase, tau, velocity, side)
            duration = arc.first_root(mpmath.pi / omega - tau)
            if duration is None:
                break
            intervals.append(duration)
            speeds.append(abs(arc.velocity(duration)))
            velocity = eta * arc.velocity(duration)
            tau += duration
            side = -side
        return intervals, speeds


class _Arc:
    """Eq. 6 after the impact at tau: phi(t) = B e^t + A e^-t + side + Xi(tau + t)."""

    def __init__(self, a, omega, phase, tau, velocity, side):
        self.amplitude = a / (omega**2 + 1)
        self.omega, self.angle, self.side = omega, omega * tau + phase, side
        forced = self.amplitude * mpmath.sin(self.angle)
        forced_velocity = omega * self.amplitude * mpmath.cos(self.angle)
        self.B = (-side - forced + velocity - forced_velocity) / 2
        self.A = (-side - forced - velocity + forced_velocity) / 2
        pull = 1 + side * a * mpmath.sin(self.angle)
        self.guess = 2 * abs(velocity) / pull if velocity else 4 * mpmath.sqrt(a**2 - 1) / omega

    def height(self, t):
        forced = self.amplitude * mpmath.sin(self.angle + self.omega * t)
        return self.side * (self.B * mpmath.exp(t) + self.A * mpmath.exp(-t) + self.side + forced)

    def velocity(self, t):
        forced = self.omega * self.amplitude * mpmath.cos(self.angle + self.omega * t)
        return self.B * mpmath.exp(t) - self.A * mpmath.exp(-t) + forced

    def first_root(self, left):
        """Duration of the arc, or None where it is longer than ``left``."""
        root = left
        if self.height(left) <= 0:
            root = self._bracketed_root(left)
        if root > mpmath.mpf("1e-4"):
            assert all(self.height(root * k / _SAMPLES) > 0 for k in range(1, _SAMPLES))
        return root if root < left else None

    def _bracketed_root(self, high):
        low, t = mpmath.mpf(0), self.guess
        if not 0 < t < high:
            t = high / 2
        for _ in range(400):
            height = self.height(t)
            if height > 0:
                low = t
            else:
                high = t
            better = t - height / (self.side * self.velocity(t))
            if not low < better < high:
                better = (low + high) / 2
            if abs(better - t) < mpmath.mpf(10) ** (12 - DIGITS) * t:
                return better
            t = better
        raise AssertionError("the root was not found")


# --- ball arithmetic ------------------------------------------------------------------------------------------


class UnprovenError(AssertionError):
    """A step of the proof did not succeed at this precision."""


@dataclass
class Settled:
    """Proven: the time of rest lies in the ball, or (None) an arc outlasts half a period."""

    time: arb | None
    impacts: int


def settle(a: float, omega: float, eta: float, *, start=None, width: float = 1e-13) -> Settled:
    """Enclose the time of rest to a relative width.

    ``start`` = (time, side entered, speed) takes up a sequence at an impact, these three taken as exact numbers.
    """
    saved = ctx.prec
    try:
        for bits in BITS:
            ctx.prec = bits
            try:
                return _Proof(arb(a), arb(omega), arb(eta)).run(start, arb(width))
            except UnprovenError:
                if bits == BITS[-1]:
                    raise
    finally:
        ctx.prec = saved


class _Proof:
    def __init__(self, a, omega, eta):
        self.a, self.omega, self.eta = a, omega, eta
        self.phase = (1 / a).asin()
        self.half_period = arb.pi() / omega

    def run(self, start, width):
        if start is None:
            tau, side, speed = arb(0), -1, arb(0)
        else:
            tau, side, speed = arb(start[0]), start[1], arb(start[2])
        for impacts in range(_MOST_IMPACTS):
            rest = self.enclosed_rest(tau, side, speed)
            if rest is not None and rest.rad() < width * tau:
                return Settled(rest, impacts)
            at_uplift = start is None and impacts == 0
            landing = self.land(tau, side, speed, at_uplift)
            if landing is None:
                return Settled(None, impacts)
            duration, impact_speed = landing
            tau, side, speed = tau + duration, -side, self.eta * impact_speed
        raise UnprovenError("too many impacts")

    def pull(self, side, tau):
        """Restoring acceleration of a side at zero rotation."""
        return 1 + side * self.a * (self.omega * tau + self.phase).sin()

    def land(self, tau, side, speed, at_uplift):
        """Enclosures of the arc's duration and impact speed; None: proven to outlast half a period."""
        arc = _BallArc(self, tau, side, speed, at_uplift)
        if arc.outlasts():
            arc.prove_positive()
            return None
        low, high = arc.enclosed_root()
        arc.prove_first_root(low, high)
        duration = low.union(high)
        return duration, arc.impact_speed(duration)

    def enclosed_rest(self, tau, side, speed):
        """Enclosure of the time of rest from an impact, or None where the bounds do not close.

        On side j let m <= g_j <= M over the window. By comparison with constant acceleration an arc of speed v lasts
        from 2 v/M to 2 atanh(v/m) (to second order in v/m) and rises to m - sqrt(m^2 - v^2) at most; energy
        then bounds the impact speed w by |w^2 - v^2| <= 2 (M - m) (height).
        """
        window = self.window(tau, side, speed)
        if window is None:
            return None
        whole = arb(0).union(window)
        ranges = {j: self.pull(j, tau + whole) for j in (side, -side)}
        least = {j: ranges[j].lower() for j in ranges}
        most = {j: ranges[j].upper() for j in ranges}
        if not all(least[j] > speed for j in ranges):
            return None
        change = {}
        for j in ranges:
            height = least[j] - (least[j] ** 2 - speed**2).sqrt()
            change[j] = 2 * (most[j] - least[j]) * height / speed**2
        fastest = {j: self.eta * (1 + change[j]).sqrt() for j in ranges}
        if not all(fastest[j] < 1 for j in ranges) or not all(change[j] < 1 for j in ranges):
            return None
        slowest = {j: self.eta * (1 - change[j]).sqrt() for j in ranges}
        longest = {j: 2 * (speed / least[j]).atanh() for j in ranges}
        shortest = {j: 2 * speed / most[j] for j in ranges}
        upper = (longest[side] + fastest[side] * longest[-side]) / (1 - fastest[side] * fastest[-side])
        lower = (shortest[side] + slowest[side] * shortest[-side]) / (1 - slowest[side] * slowest[-side])
        if not upper < window or not tau + window < self.half_period:
            return None
        return tau + lower.union(upper)

    def window(self, tau, side, speed):
        """One and a half times the geometric sum with the accelerations of this instant."""
        here, there = self.pull(side, tau), self.pull(-side, tau)
        if not (speed > 0 and here > 0 and there > 0):
            return None
        total = 2 * speed * (1 / here + self.eta / there) / (1 - self.eta**2)
        return (total * 3 / 2).mid()


class _BallArc:
    """Height u = |phi| over one side after an impact.

    In closed form for signs at long times; else as a Taylor polynomial with remainder, whose coefficients follow from
    speed and phase: in the closed form the enclosure of a short arc would be as wide as that of the impact's
    time, not narrower by the arc's duration squared.
    """

    def __init__(self, proof, tau, side, speed, at_uplift):
        self.proof, self.side, self.speed, self.at_uplift = proof, side, speed, at_uplift
        self.angle = proof.omega * tau + proof.phase
        self.left = proof.half_period - tau
        self.amplitude = proof.a / (proof.omega**2 + 1)
        forced = side * self.amplitude * self.angle.sin()
        forced_rate = side * self.amplitude * proof.omega * self.angle.cos()
        self.B = (-1 - forced + speed - forced_rate) / 2
        self.A = (-1 - forced - speed + forced_rate) / 2
        self.first_power = 3 if at_uplift else 1

    def outlasts(self):
        """Whether u > 0 at half a period after uplift."""
        t = self.left
        angle = self.angle + self.proof.omega * t
        return self.B * t.exp() + self.A * (-t).exp() + 1 + self.side * self.amplitude * angle.sin() > 0

    def expand(self, reach):
        """Taylor polynomial and remainder for 0 <= t <= reach."""
        reach = reach.upper()
        spread = abs(self.B) * reach.exp() + abs(self.A)
        order, term = 2, spread + abs(self.amplitude)
        while order < 4 or not term < arb(2) ** -ctx.prec * reach ** (self.first_power + 1):
            order += 2
            term = (spread + abs(self.amplitude) * self.proof.omega**order) * reach**order / arb(order).gamma() / order
        self.reach = reach
        self.polynomial = arb_poly(self.coefficients(order))
        self.rate = self.polynomial.derivative()
        self.remainder = (term / reach**order).upper()
        self.order = order

    def coefficients(self, order):
        """Coefficients c_k of u below an order: u'' = u - g."""
        c = [arb(0), self.speed]
        forced = [self.side * self.proof.a * self.angle.sin(), self.side * self.proof.a * self.angle.cos()]
        pull = -(1 + forced[0])
        factorial, power = arb(1), arb(1)
        for k in range(order - 2):
            if k > 0:
                factorial *= k
                power *= self.proof.omega
                pull = -forced[k % 2] * (1 if k % 4 < 2 else -1) * power / factorial
            c.append((c[k] + pull) / ((k + 1) * (k + 2)))
        if self.at_uplift:
            c[1] = c[2] = arb(0)
        return c

    def height(self, t):
        return self.polynomial(t) + self._error(t, 0)

    def height_rate(self, t):
        return self.rate(t) + self._error(t, 1)

    def impact_speed(self, t):
        """2 u/t - u' at a root t: without the coefficient of t^2, by which each impact would triple the ball."""
        coefficients = [(2 - k) * self.polynomial[k] for k in range(1, self.order)]
        return arb_poly(coefficients)(t) + 3 * self._error(t, 1)

    def _error(self, t, derivative):
        """Remainder of the polynomial or of its derivative: |u^(n)| t^n/n!, or times n/t."""
        size = self.remainder * abs(t).upper() ** (self.order - derivative) * self.order**derivative
        return (-size).union(size)

    def enclosed_root(self):
        """Low and high with positive height at low and negative at high, as close as the precision lets."""
        self.expand(self.guess())
        if not self.height(self.reach) < 0:
            self.expand(self.left)
        low, high = arb(0), self.reach
        t = (high / 2).mid()
        for _ in range(400):
            height = self.height(t)
            if height > 0:
                low = t
            elif height < 0:
                high = t
            better = (t - height / self.height_rate(t)).mid()
            if not (better > low and better < high):
                better = ((low + high) / 2).mid()
            moved = abs(better - t)
            t = better
            if moved < t * arb(2) ** (-ctx.prec // 4):
                return self.widened(t)
        raise UnprovenError("the root was not found")

    def guess(self):
        """Twice the arc's duration at constant acceleration (at uplift: jerk), or all that is left."""
        pull = 1 + self.side * self.proof.a * self.angle.sin()
        if self.at_uplift:
            estimate = (8 * (self.proof.a**2 - 1).sqrt() / self.proof.omega).mid()
        elif pull > 0:
            estimate = (4 * self.speed / pull).mid()
        else:
            return self.left
        return estimate if estimate < self.left else self.left

    def widened(self, t):
        for _ in range(3):
            t = (t - self.height(t) / self.height_rate(t)).mid()
        margin = t * arb(2) ** (20 - ctx.prec)
        while margin < t / 4096:
            low, high = (t - margin).mid(), (t + margin).mid()
            if self.height(low) > 0 and self.height(high) < 0:
                return low, high
            margin *= 2
        raise UnprovenError("the precision is exhausted")

    def prove_first_root(self, low, high):
        """Prove that u, positive at low and negative at high, has no root before low."""
        if self.concave(low):
            return
        for halvings in range(6, 30, 4):
            before = (low * (1 - arb(2) ** -halvings)).mid()
            if self.height_rate(before.union(high)) < 0:
                self._prove_cells(arb(0), before, 0)
                return
        raise UnprovenError("the arc is not proven to fall towards its root")

    def prove_positive(self):
        """Prove u > 0 up to half a period after uplift."""
        self.expand(self.left)
        if not self.concave(self.left):
            self._prove_cells(arb(0), self.reach, 0)

    def concave(self, end):
        """Whether u'' = u - g < 0 on [0, end], from u <= speed sinh(t) where g >= 0."""
        if self.at_uplift:
            return False
        pull = 1 + self.side * self.proof.a * (self.angle + self.proof.omega * arb(0).union(end)).sin()
        return bool(pull > self.speed * end.upper().sinh())

    def _prove_cells(self, low, high, depth):
        if self._positive_on(low, high):
            return
        if depth == _DEEPEST_SPLIT:
            raise UnprovenError("the arc could not be proven positive")
        middle = ((low + high) / 2).mid()
        self._prove_cells(low, middle, depth + 1)
        self._prove_cells(middle, high, depth + 1)

    def _positive_on(self, low, high):
        """The first cell without the powers of t that vanish at its start; others by the mean value."""
        cell = low.union(high)
        if not low > 0:
            deflated = arb_poly([self.polynomial[k] for k in range(self.first_power, self.order)])
            size = self.remainder * high.upper() ** (self.order - self.first_power)
            return bool(deflated(cell) - size > 0)
        middle = cell.mid()
        return bool(self.height(middle) - abs(self.height_rate(cell)) * cell.rad() > 0)
