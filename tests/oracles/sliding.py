"""Rocking and sliding with Coulomb friction by SciPy's DOP853, restarted at every event.

Newton's and Euler's equations of a planar body on two pivots, in metres and seconds, and without any code of the
package. The foot (the pivot in contact) has moved by X relative to the ground; u >= 0 is the rotation towards side
i = +1 or -1, and s = sign(X') the direction of slip. In the linear model sine and cosine of alpha - u are alpha - u and
1, the square of the rate is dropped, and the centre of mass is h above the pivots.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Any

import mpmath
import numpy as np
from scipy.integrate import DOP853
from scipy.optimize import brentq, minimize_scalar

G = 9.80665
REST, SLIDE, ROCK, SLIDE_ROCK = "rest", "slide", "rock", "slide-rock"
Pair = tuple[float, float]


@dataclass(frozen=True)
class Slider:
    """A body with its friction. Pairs refer to side + and side -."""

    distances: Pair
    height: float
    gyration: Pair  # squared, at each pivot; equal except in the linear model of a body with two unequal sides
    alpha: Pair
    arm: Pair  # distance of the centre of mass from each pivot
    factors: Pair  # on the speed, on leaving each side, without slip
    static: float
    kinetic: float
    linear: bool = False

    @classmethod
    def on_pivots(
        cls, distances: Pair, height: float, k: float, friction: float | Pair, factors: Pair | None = None
    ) -> "Slider":
        """A body of the nonlinear model; without factors, angular momentum about the new pivot is conserved."""
        rest = height * height + k * k
        conserved = [(rest - distances[0] * distances[1]) / (rest + distances[1 - n] ** 2) for n in range(2)]
        static, kinetic = (friction, friction) if isinstance(friction, float) else friction
        angles = tuple(math.atan2(d, height) for d in distances)
        arms = tuple(math.hypot(d, height) for d in distances)
        return cls(distances, height, (k * k, k * k), angles, arms, factors or (*conserved,), static, kinetic)

    @classmethod
    def slender(cls, p: Pair, alpha: Pair, factors: Pair, height: float, friction: float | Pair) -> "Slider":
        """A body of the linear model."""
        static, kinetic = (friction, friction) if isinstance(friction, float) else friction
        distances = tuple(height * angle for angle in alpha)
        gyration = tuple(G * height / p[n] ** 2 - height**2 - distances[n] ** 2 for n in range(2))
        return cls(distances, height, gyration, alpha, (height, height), factors, static, kinetic, linear=True)

    def slope(self, i: int) -> float:
        """The least |horizontal|/vertical force that lifts the body to a side."""
        return self.alpha[_n(i)] if self.linear else self.distances[_n(i)] / self.height

    def _inertia(self, i: int) -> float:
        """Squared radius of gyration for arcs on a side."""
        n = _n(i)
        return self.gyration[n] + (self.distances[n] ** 2 if self.linear else 0.0)

    def _position(self, i: int, u: float) -> Pair:
        psi = self.alpha[_n(i)] - u
        return (psi, 1.0) if self.linear else (math.sin(psi), math.cos(psi))

    def stick(self, i: int, u: float, w: float, a: float, weight: float) -> tuple[float, float, float]:
        """Angular acceleration, horizontal and vertical force without slip."""
        s, c = self._position(i, u)
        r, q = self.arm[_n(i)], 0.0 if self.linear else w * w
        rate = -r * (weight * s + i * a * c) / (self._inertia(i) + r * r)
        normal = weight if self.linear else weight + r * (s * rate - c * q)
        return rate, a + i * r * (c * rate + s * q), normal

    def slip(self, i: int, sigma: int, u: float, w: float, a: float, weight: float) -> tuple[float, float, float]:
        """Angular acceleration, acceleration of the foot, and vertical force while slipping."""
        s, c = self._position(i, u)
        r, q, inertia = self.arm[_n(i)], 0.0 if self.linear else w * w, self._inertia(i)
        lever = s - i * sigma * self.kinetic * c
        normal = weight if self.linear else (weight - r * c * q) / (1.0 + r * r / inertia * s * lever)
        rate = -r / inertia * normal * lever
        return rate, -sigma * self.kinetic * normal - a - i * r * (c * rate + s * q), normal

    def clearance(self, i: int, u: float, w: float, weight: float) -> float:
        """Vertical acceleration of the ground's contact relative to a body in free fall: contact while positive."""
        return weight if self.linear else weight - self.arm[_n(i)] * self._position(i, u)[1] * w * w

    def moments(self, i: int, u: float, w: float, V: float) -> tuple[float, float, float]:
        """Horizontal and vertical momentum and kinetic energy per mass, relative to the ground."""
        s, c = self._position(i, u)
        r = self.arm[_n(i)]
        across, up = V + i * r * c * w, 0.0 if self.linear else r * s * w
        spin = self._inertia(i) * w * w
        return across, up, 0.5 * (across * across + up * up + spin)

    def potential(self, i: int, u: float) -> float:
        """Potential energy per mass under gravity alone."""
        r, alpha = self.arm[_n(i)], self.alpha[_n(i)]
        return G * r * (alpha * u - 0.5 * u * u) if self.linear else G * r * (math.cos(alpha - u) - math.cos(alpha))

    def impact(self, i: int, w: float, V: float) -> tuple[float, float, float, float]:
        """Speed and slip after an impact that leaves side i, and both impulses."""
        n, m, j = _n(i), _n(-i), -i
        d, e, h, k2 = self.distances[n], self.distances[m], self.height, self.gyration[m]
        inertia = k2 + h * h + e * e
        couple = (self.factors[n] * inertia - (k2 + h * h - d * e)) * w
        mu = self.static if V == 0.0 else self.kinetic
        after, slip = self.factors[n] * w + j * h * V / inertia, 0.0
        upward, across = e * after + d * w, j * h * (after - w) - V
        if abs(across) > mu * upward:
            sigma = -1 if across > 0.0 else 1
            lever = e - j * sigma * self.kinetic * h
            after = (k2 * w - d * lever * w + couple) / (k2 + e * lever)
            upward = e * after + d * w
            across = -sigma * self.kinetic * upward
            slip = V + across - j * h * (after - w)
        if after <= 0.0:  # both pivots strike
            after, upward, across, slip = 0.0, d * w, -V - j * h * w, 0.0
            if abs(across) > mu * upward:
                across = -math.copysign(self.kinetic * upward, V + j * h * w)
                slip = V + j * h * w + across
        return after, slip, across, upward

    def closing(self, i: int, sigma: int, a: float, weight: float) -> tuple[float, float]:
        """Restoring acceleration on a side at zero rotation, and factor on the speed on leaving it, while slipping."""
        speed = 1.0
        after, slip, across, upward = self.impact(i, speed, 1e9 * sigma)
        rate, _, _ = self.slip(i, sigma, 0.0, 0.0, a, weight)
        assert slip * sigma > 0.0 and abs(across) <= self.kinetic * upward * (1.0 + 1e-12)
        return -rate, after


def _n(i: int) -> int:
    return 0 if i > 0 else 1


@dataclass(frozen=True)
class Shaking:
    """Accelerations as functions of time (s) between breakpoints; zero from the last one on."""

    breaks: Sequence[float]
    across: Callable[[float], float]
    up: Callable[[float], float] | None = None
    samples: int = 2  # points between breakpoints in the search for a threshold: 2 if linear in between

    def at(self, t: float, piece: int) -> Pair:
        """Both accelerations, within a piece, the last of which is at rest."""
        if piece >= len(self.breaks) - 1:
            return 0.0, 0.0
        inside = min(max(t, self.breaks[piece]), math.nextafter(self.breaks[piece + 1], -1.0))
        return self.across(inside), self.up(inside) if self.up else 0.0


def sampled(dt: float, across: Sequence[float], up: Sequence[float] | None = None) -> Shaking:
    """Straight lines between samples at steps dt."""

    def line(values: Sequence[float]) -> Callable[[float], float]:
        def evaluate(t: float) -> float:
            k = min(max(int(t / dt), 0), len(values) - 2)
            while k + 1 < len(values) - 1 and (k + 1) * dt <= t:
                k += 1
            while k > 0 and k * dt > t:
                k -= 1
            return values[k] + (values[k + 1] - values[k]) * (t - k * dt) / dt

        return evaluate

    return Shaking([k * dt for k in range(len(across))], line(across), None if up is None else line(up))


@dataclass
class Motion:
    """Outcome of a run."""

    verdict: str = ""
    peak: float = 0.0
    peak_time: float = 0.0
    slip: float = 0.0
    largest_slip: float = 0.0
    end: float = 0.0
    impacts: list[Any] = field(default_factory=list)  # time, side entered, speed and slip before, and after, impulses
    modes: list[tuple[float, str, int, int]] = field(default_factory=list)  # time, mode, side, direction of slip
    states: list[tuple[float, float, float, float, float]] = field(default_factory=list)  # t, i u, i u', X, X'
    margin: float = math.inf  # least relative distance of a verdict or a decision from the opposite one
    uncertified: int = 0  # sequences of alternating slip and stick, cut at the smallest speed
    balance: tuple[float, float, float] = (0.0, 0.0, 0.0)  # largest residuals: energy, both momenta (relative)


#: Components of the state: rotation and rate, slip and rate, impulses of the ground, work of ground and friction.
_SIZE = 8


def follow(
    body: Slider,
    shaking: Shaking,
    start: Pair = (0.0, 0.0),
    *,
    rtol: float = 1e-12,
    closing_speed: float = 1e-8,
    until: float = 200.0,
    step_ratio: float = 0.15,
) -> Motion:
    """Follow the body to rest after the motion, to overturning, to the loss of contact, or to a time."""
    run, t, piece, last = Motion(), 0.0, 0, len(shaking.breaks) - 1
    y = np.zeros(_SIZE)
    i = 1 if (start[0] or start[1]) > 0.0 else -1
    y[0], y[1] = abs(start[0]), i * start[1]
    run.peak = float(y[0])
    rates = [math.sqrt(G * body.arm[n] / (body.gyration[n] + body.height**2 + body.distances[n] ** 2)) for n in (0, 1)]
    slow = closing_speed * min(rates) * min(body.alpha)
    longest = step_ratio / max(rates)
    impulse, lost = np.zeros(2), 0.0
    first_energy = body.moments(i, y[0], y[1], 0.0)[2] + body.potential(i, y[0])
    scales = (G * body.height, math.sqrt(G * body.height), math.sqrt(G * body.height))
    mode, sigma = "", 0

    def enter(new: str, side: int, direction: int) -> None:
        nonlocal mode, i, sigma
        if new != mode or side != i or direction != sigma:
            run.modes.append((t, new, side, direction))
        mode, i, sigma = new, side, direction

    def decide(left: str = "") -> None:
        """Choose the mode of the present state; ``left`` names the threshold that has just been passed."""
        a, lift = shaking.at(t, piece)
        weight = G + lift
        flat = y[0] <= 0.0 and y[1] <= 0.0
        if y[3] != 0.0:
            direction = 1 if y[3] > 0.0 else -1
            if flat and body.kinetic <= body.slope(direction):
                return enter(SLIDE, i, direction)
            return enter(SLIDE_ROCK, direction if flat else i, direction)
        side = (-1 if a > 0.0 else 1) if flat else i
        if flat:
            limit = weight * min(body.static, body.slope(side))
            if left != "rest" and abs(a) <= limit:
                return enter(REST, i, 0)
            if body.static <= body.slope(side):
                return enter(SLIDE, i, side)
        _, force, normal = body.stick(side, max(y[0], 0.0), y[1], a, weight)
        if left != "cone" and abs(force) <= body.static * normal:
            return enter(ROCK, side, 0)
        direction = -1 if force > 0.0 else 1
        if flat and body.kinetic <= body.slope(direction):
            return enter(SLIDE, i, direction)
        return enter(SLIDE_ROCK, side, direction)

    def derivative(time: float, z: Any) -> list[float]:
        u, w, _, V = z[0], z[1], z[2], z[3]
        a, lift = shaking.at(time, piece)
        weight = G + lift
        if mode == SLIDE:
            force = -sigma * body.kinetic * weight
            return [0.0, 0.0, V, force - a, force - a, 0.0, -a * V, force * V]
        across, up, _ = body.moments(i, u, w, V)
        if mode == ROCK:
            rate, force, normal = body.stick(i, u, w, a, weight)
            dV, V = 0.0, 0.0
        else:
            rate, dV, normal = body.slip(i, sigma, u, w, a, weight)
            force = -sigma * body.kinetic * normal
        raising = body.arm[_n(i)] * (body.alpha[_n(i)] - u) * w if body.linear else up
        work = -a * across - lift * raising
        return [w, rate, V, dV, force - a, normal - weight, work, force * V]

    def functions(time: float, z: Any) -> list[float]:
        a, lift = shaking.at(time, piece)
        weight = G + lift
        if mode == SLIDE:
            return [sigma * z[3], weight]
        values = [z[0], 0.5 * math.pi - z[0], body.clearance(i, z[0], z[1], weight)]
        if mode == SLIDE_ROCK:
            return [*values, sigma * z[3]]
        _, force, normal = body.stick(i, z[0], z[1], a, weight)
        return [*values, body.static * normal - force, body.static * normal + force]

    def check() -> None:
        across, up, kinetic = body.moments(i, y[0], y[1], y[3])
        energy = kinetic + body.potential(i, y[0]) - first_energy - y[6] - y[7] + lost
        residuals = (energy, across - y[4] - impulse[0], 0.0 if body.linear else up - y[5] - impulse[1])
        run.balance = tuple(
            max(old, abs(new / scale)) for old, new, scale in zip(run.balance, residuals, scales, strict=True)
        )

    across, up, _ = body.moments(i, y[0], y[1], 0.0)
    impulse[:] = across, up
    decide()
    while t < until:
        while piece < last and t >= shaking.breaks[piece + 1]:
            piece += 1
        end = math.inf if piece >= last else shaking.breaks[piece + 1]
        run.states.append((t, i * y[0], i * y[1], y[2], y[3]))
        if mode == REST:
            if piece >= last:
                run.verdict = "stays"
                break

            def excess(time: float) -> float:
                a, lift = shaking.at(time, piece)
                side = -1 if a > 0.0 else 1
                return abs(a) - (G + lift) * min(body.static, body.slope(side))

            grid = np.linspace(t, math.nextafter(end, 0.0), shaking.samples)
            passed = next((k for k, time in enumerate(grid) if excess(time) > 0.0), None)
            if passed is None:
                t = end
                continue
            if passed > 0:
                t = brentq(excess, grid[passed - 1], grid[passed], xtol=1e-15, rtol=1e-14)
            if G + shaking.at(t, piece)[1] <= 1e-12:
                run.verdict = "lost contact"
                break
            decide("rest")
            continue
        if mode == ROCK:  # the motion may have jumped
            a, lift = shaking.at(t, piece)
            _, force, normal = body.stick(i, y[0], y[1], a, G + lift)
            if abs(force) > body.static * normal + 1e-11 * G:
                decide("cone")
        if mode == SLIDE_ROCK and body.clearance(i, y[0], y[1], G + shaking.at(t, piece)[1]) <= 0.0:
            run.verdict = "lost contact"
            break
        step = longest
        if mode != SLIDE and y[0] == 0.0 and y[1] > 0.0:
            pull = -derivative(t, y)[1]
            step = min(longest, 0.5 * y[1] / pull) if pull > 0.0 else longest
        solver = DOP853(derivative, t, y.copy(), min(end, until), rtol=rtol, atol=1e-16, max_step=step)
        event = None
        first = True
        while solver.status == "running" and event is None:
            t0, y0 = solver.t, solver.y.copy()
            solver.step()
            dense = solver.dense_output()
            times = np.linspace(t0, solver.t, 7)
            points = [y0, *(dense(time) for time in times[1:-1]), solver.y]
            if mode != SLIDE:  # a function may be negative only between two times
                dips = _find_dips(functions, dense, t0, float(solver.t))
                times = np.union1d(times, dips)
                points = [y0 if time == t0 else (solver.y if time == solver.t else dense(time)) for time in times]
            for k in range(1, len(times)):
                new = functions(times[k], points[k])
                fresh = first and k == 1
                roots = []
                for m in (m for m in range(len(new)) if new[m] <= 0.0):
                    low = _find_positive(functions, dense, m, float(times[k - 1]), float(times[k]))
                    if low is not None:
                        root = brentq(lambda x, m=m: functions(x, dense(x))[m], low, times[k], xtol=1e-16, rtol=1e-14)
                        roots.append((root, m))
                    elif not fresh:
                        roots.append((float(times[k - 1]), m))
                if roots:
                    event = min(roots)
                    break
            stop = event[0] if event else solver.t
            if mode != SLIDE:
                for k in range(len(times) - 1):
                    if times[k] < stop and points[k][1] > 0.0 >= points[k + 1][1]:
                        top = (
                            brentq(lambda x: dense(x)[1], times[k], times[k + 1], xtol=1e-15)
                            if points[k + 1][1] < 0
                            else times[k + 1]
                        )
                        if top <= stop and dense(top)[0] > run.peak:
                            run.peak, run.peak_time = float(dense(top)[0]), top
            first = False
            if event and event[0] > t0:
                final = DOP853(derivative, t0, y0, stop, rtol=rtol, atol=1e-16, max_step=step, first_step=stop - t0)
                while final.status == "running":
                    final.step()
                t, y = stop, final.y.copy()
            elif event:
                t, y = t0, y0
            else:
                t, y = solver.t, solver.y.copy()
                run.states.append((t, i * y[0], i * y[1], y[2], y[3]))
            if mode != SLIDE and y[0] > run.peak:
                run.peak, run.peak_time = float(y[0]), t
            run.largest_slip = max(run.largest_slip, abs(y[2]))
        check()
        if event is None:
            continue
        m = event[1]
        if (mode == SLIDE and m == 1) or (mode != SLIDE and m == 2):
            run.verdict = "lost contact"
            break
        if mode != SLIDE and m == 1:
            run.verdict, run.peak, run.peak_time = "overturns", 0.5 * math.pi, t
            break
        if mode == SLIDE or (mode == SLIDE_ROCK and m == 3):
            y[3] = 0.0
            decide()
            continue
        if m >= 3:
            decide("cone")
            continue
        w, V = -y[1], y[3]
        before = body.moments(i, 0.0, y[1], V)
        after, slip, jx, jy = body.impact(i, w, V)
        i = -i
        y[0], y[1], y[3] = 0.0, after, slip
        now = body.moments(i, 0.0, after, slip)
        lost += before[2] - now[2]
        impulse += jx, jy
        run.impacts.append((t, i, w, V, after, slip, jx, jy))
        check()
        if after < slow and _close(body, shaking, run, y, i, t, piece, slow * 1e-4):
            remaining, shift, drift = _rest(body, shaking, y, i, t, piece)
            gone = body.moments(i, 0.0, y[1], y[3])
            y[0] = y[1] = 0.0
            y[3] = y[3] + drift
            still = body.moments(i, 0.0, 0.0, y[3])
            lost += gone[2] - still[2]
            impulse += still[0] - gone[0], still[1] - gone[1]
            t += remaining
            y[2] += y[3] * remaining + shift
            while piece < last and t >= shaking.breaks[piece + 1]:
                piece += 1
        decide()
    run.slip, run.end = float(y[2]), t
    return run


def _find_positive(functions: Any, dense: Any, m: int, low: float, high: float) -> float | None:
    """The first of some times between two at which an event function is positive; None without one."""
    for j in range(48, -1, -1):
        time = low + (high - low) * (2.0**-j if j < 48 else 0.0)
        if functions(time, dense(time))[m] > 0.0:
            return time
    return None


def _find_dips(functions: Any, dense: Any, start: float, end: float) -> list[float]:
    """Times at which an event function has a negative minimum between two times at which it is positive."""
    grid = np.linspace(start, end, 13)
    values = np.array([functions(time, dense(time)) for time in grid])
    rates = [dense(time)[1] for time in grid]
    ends = [(grid[k], grid[k + 1]) for k in range(12) if rates[k] < 0.0 < rates[k + 1]]
    dips = [brentq(lambda time: dense(time)[1], *pair, xtol=1e-16) for pair in ends]  # of the rotation
    for m in range(values.shape[1]):
        for k in range(1, 12):
            if values[k, m] > 0.0 and values[k - 1, m] > values[k, m] < values[k + 1, m]:
                options = {"bounds": (grid[k - 1], grid[k + 1]), "method": "bounded", "options": {"xatol": 1e-13}}
                low = minimize_scalar(lambda time, m=m: functions(time, dense(time))[m], **options)
                dips += [float(low.x)] if low.fun < 0.0 else []
    return dips


def _close(body: Slider, shaking: Shaking, run: Motion, y: Any, i: int, t: float, piece: int, slowest: float) -> bool:
    """Whether the rest of a sequence of impacts may be summed."""
    a, lift = shaking.at(t, piece)
    weight = G + lift
    if y[1] == 0.0:
        return False
    if y[3] == 0.0:
        for side in (1, -1):
            rate, force, normal = body.stick(side, 0.0, 0.0, a, weight)
            _, slip, _, _ = body.impact(side, 1.0, 0.0)
            if rate >= 0.0:
                return False
            if slip != 0.0 or abs(force) > body.static * normal:
                break
        else:
            return True
    elif abs(y[3]) > 1e3 * body.height * y[1]:
        sigma = 1 if y[3] > 0.0 else -1
        return all(body.closing(side, sigma, a, weight)[0] > 0.0 for side in (1, -1))
    if y[1] > slowest or min(-body.stick(side, 0.0, 0.0, a, weight)[0] for side in (1, -1)) <= 0.0:
        return False
    run.uncertified += 1
    y[3] = 0.0
    return True


def _rest(body: Slider, shaking: Shaking, y: Any, i: int, t: float, piece: int) -> tuple[float, float, float]:
    """Time to the end of a sequence under constant accelerations, and changes of slip and its rate until then."""
    a, lift = shaking.at(t, piece)
    weight = G + lift
    if y[3] == 0.0:
        (g, e), (f, b) = ((-body.stick(side, 0.0, 0.0, a, weight)[0], body.factors[_n(side)]) for side in (i, -i))
        return 2.0 * y[1] * (1.0 / g + e / f) / (1.0 - e * b), 0.0, 0.0
    sigma, w, d, o = 1 if y[3] > 0.0 else -1, y[1], body.distances[_n(i)], body.distances[_n(-i)]
    (g, e), (f, b) = (body.closing(side, sigma, a, weight) for side in (i, -i))
    product = e * b
    first, second = 2.0 * (1.0 / g + e / f) / (1.0 - product), 2.0 * (1.0 / f + b / g) / (1.0 - product)
    remaining = first * w
    drift, shift = i * body.height * w, 0.0
    if body.linear:  # impulses of the ground at the impacts, besides the weight
        leaving, returning = (d + o * e) * w, (o + d * b) * e * w
        drift -= sigma * body.kinetic * (leaving + returning) / (1.0 - product)
        held = leaving * second * e * w + returning * first * product * w
        shift -= sigma * body.kinetic * held / (1.0 - product**2) + drift * remaining
        shift += i * body.height * w * remaining
    else:
        drift += sigma * body.kinetic * d * w
    braking = a + sigma * body.kinetic * weight
    return remaining, shift + 0.5 * braking * remaining**2, drift - braking * remaining


def sum_sequence(case: Any) -> Any:
    """The time of all arcs of a sequence that slides, in 40 digits; its slowest arcs are a geometric sum."""
    mp = mpmath.mp.clone()
    mp.dps = 50
    linear = case.model == "linear"
    sides = case.block.sides
    height = mp.mpf(sum(side.radius * math.cos(side.alpha) for side in sides)) / 2
    laws = []
    for n, side in enumerate(sides):
        i, o = 1 - 2 * n, sides[1 - n]
        arm = height if linear else mp.mpf(side.radius)
        inertia = mp.mpf(G) * arm / mp.mpf(side.p) ** 2
        mu = i * case.direction * mp.mpf(case.friction)
        far = height if linear else mp.mpf(o.radius)
        h = height
        d = h * mp.mpf(side.alpha) if linear else arm * mp.sin(mp.mpf(side.alpha))
        e = h * mp.mpf(o.alpha) if linear else far * mp.sin(mp.mpf(o.alpha))
        other = mp.mpf(G) * far / mp.mpf(o.p) ** 2
        square = other - h * h - e * e
        couple = mp.mpf(side.restitution) * other - (square + h * h - d * e)
        lever = e + mu * h  # towards the other side, the slip has the other sign
        factor = (square - d * lever + couple) / (square + e * lever)
        laws.append((mp.mpf(side.alpha), arm, inertia - arm * arm, mu, max(factor, mp.mpf(0))))

    def arc(n: int, w: Any) -> Any:
        """Duration of an arc, by its Taylor series about the impact."""
        alpha, arm, gyration, mu, _ = laws[n]
        lam, rho, g = G * arm / gyration, arm * arm / gyration, mp.mpf(G)
        if linear:
            root, pull = mp.sqrt(lam), lam * (alpha - mu)
            return 2 / root * mp.atanh(root * w / pull)
        pull = lam * (mp.sin(alpha) - mu * mp.cos(alpha))
        pull /= 1 + rho * mp.sin(alpha) * (mp.sin(alpha) - mu * mp.cos(alpha))
        order = min(24, 5 + int(50 / -mp.log10(mp.sqrt(lam) * w / pull)))  # terms are as small as the speed
        u, s, c = [mp.mpf(0), w], [mp.sin(alpha)], [mp.cos(alpha)]
        q, b, D, N = [], [], [], []

        def product(x: list[Any], y: list[Any], k: int) -> Any:
            return mp.fsum(x[m] * y[k - m] for m in range(k + 1))

        for k in range(order):
            if k:
                rates = [(m + 1) * u[m + 1] for m in range(k)]
                s.append(-product(rates, c, k - 1) / k)
                c.append(product(rates, s[:k], k - 1) / k)
            rates = [(m + 1) * u[m + 1] for m in range(k + 1)]
            q.append(product(rates, rates, k))
            b.append(s[k] - mu * c[k])
            D.append((1 if k == 0 else 0) + rho * product(s, b, k))
            lift = (1 if k == 0 else 0) - arm / g * product(c, q, k)
            N.append((lift - mp.fsum(D[m] * N[k - m] for m in range(1, k + 1))) / D[0])
            u.append(-lam * product(N, b, k) / ((k + 1) * (k + 2)))
        t = -w / u[2]
        for _ in range(8):
            value = slope = mp.mpf(0)
            for m in range(order, 0, -1):  # of u divided by t
                slope = slope * t + value
                value = value * t + u[m]
            t -= value / slope
        return t

    tiny, total, w, n = mp.mpf(10) ** -18, mp.mpf(0), mp.mpf(case.speed), case.side
    while w > tiny:
        total += arc(n, w)
        w *= laws[n][4]
        n = 1 - n
    if w > 0:
        pulls = [2 * tiny / arc(k, tiny) for k in (0, 1)]
        total += 2 * w * (1 / pulls[n] + laws[n][4] / pulls[1 - n]) / (1 - laws[0][4] * laws[1][4])
    return total
