"""Impacts and rests of the cases of benchmarks/accumulation with 50 digits, along closed-form arcs.

x'' = stiffness x - damping x' - side pull - gain a(t) between events. No impact is passed: with x'' >= -K the body
stays in front of its stop for (v + sqrt(v^2 + 2 K x))/K, and steps of that length converge to the first impact. The
impacts are followed until the speed is 1e-15; of the rest of the sequence, over in some 1e-13 s, the sum is that of a
constant acceleration, wrong by a share of 1e-13 at most.
"""

from typing import Any

from mpmath import mp, mpf

SLOW = 1e-15
_MARGIN = mpf(2)


class Followed:
    """Impacts up to the last one that is asked for, and all rests, of one case."""

    def __init__(self, case: dict[str, Any]) -> None:
        self.case, self.block = case, case["body"] == "block"
        names = ("restitution", "stiffness", "damping", "pull", "gain", "duration")
        self.e, self.k, self.c, self.pull, self.gain, self.end = (mpf(case[name]) for name in names)
        self.stops = [None if case[name] is None else mpf(case[name]) for name in ("low", "high")]
        self._longest = 1 / mp.sqrt(abs(self.k)) if self.k else self.end
        self.motion = case["motion"] or {}
        self.breaks = self._breaks()
        self.impacts: list[Any] = []
        self.rests: list[Any] = []
        self._march()

    def _breaks(self) -> list[Any]:
        """Where the motion changes its formula, up to the end."""
        if not self.motion:
            inside = []
        elif "samples" in self.motion:
            inside = [mpf(self.motion["dt"]) * n for n in range(len(self.motion["samples"]))]
        else:
            inside = [mpf(0), mpf(self.motion["cycles"]) / mpf(self.motion["frequency"])]
        return sorted({*(t for t in inside if 0 < t < self.end), self.end})

    def motion_at(self, t: Any, piece: int) -> tuple[Any, Any]:
        """Acceleration of the support and its rate, by the formula of a piece."""
        given = self.motion
        if given and "samples" in given:
            if piece + 1 >= len(given["samples"]):
                return mpf(0), mpf(0)
            dt, left, right = mpf(given["dt"]), mpf(given["samples"][piece]), mpf(given["samples"][piece + 1])
            return left + (right - left) * (t / dt - piece), (right - left) / dt
        if not given or piece > 0:
            return mpf(0), mpf(0)
        w, amplitude = 2 * mp.pi * mpf(given["frequency"]), mpf(given["amplitude"])
        at = w * t + mpf(given["phase"])
        return amplitude * mp.sin(at), amplitude * w * mp.cos(at)

    def particular(self, t: Any, piece: int, side: int) -> tuple[Any, Any]:
        """Some solution that the arc differs from by one without force, and its rate, at a time."""
        a, rate = self.motion_at(t, piece)
        k, c, g, weight = self.k, self.c, self.gain, side * self.pull
        if self.motion and "samples" not in self.motion and piece == 0:
            w = 2 * mp.pi * mpf(self.motion["frequency"])
            # (k + w^2) P + c w Q = g, (k + w^2) Q - c w P = 0 for P sin + Q cos over the amplitude.
            down = (k + w * w) ** 2 + (c * w) ** 2
            p, q = g * (k + w * w) / down, g * c / down
            x, v = p * a + q * rate, p * rate - q * w * w * a
            return (x + weight / k, v) if k else (x - weight * t * t / 2, v - weight * t)
        if k:
            slope = g * rate / k
            return (weight + g * a + c * slope) / k, slope
        start = a - rate * t
        return -(weight + g * start) * t**2 / 2 - g * rate * t**3 / 6, -(weight + g * start) * t - g * rate * t**2 / 2

    def free(self, x: Any, v: Any, h: Any) -> tuple[Any, Any]:
        """State after h without force."""
        k, c = self.k, self.c
        if k == 0:
            return x + v * h, v
        half = -c / 2
        inside = half * half + k
        root, fade = mp.sqrt(abs(inside)), mp.exp(half * h)
        cosine, sine = (mp.cosh(root * h), mp.sinh(root * h)) if inside > 0 else (mp.cos(root * h), mp.sin(root * h))
        slope = (v - half * x) / root
        at = x * cosine + slope * sine
        change = slope * cosine * root + x * sine * (root if inside > 0 else -root)
        return fade * at, fade * (half * at + change)

    def _march(self) -> None:
        t, piece, (x, v) = mpf(0), 0, (mpf(each) for each in self.case["start"])
        side, resting = (1 if x > 0 or not self.block else -1), False
        while t < self.end:
            if resting:
                found = self._release(t, piece, side)
                if found is None:
                    t, piece = self.breaks[piece], piece + 1
                    continue
                (t, side), resting = found, False
                x, v = self._at_rest(side), mpf(0)
            t, x, v, hit = self._arc(t, x, v, piece, side)
            if hit is None:
                piece += 1
                continue
            self.impacts.append(t)
            v *= self.e if self.block else -self.e
            side = -side if self.block else hit
            speed, press = abs(v), self._press(t, piece, side)
            if press > 0 and speed < SLOW:
                # Speeds shrink by the restitution, and each arc lasts 2 v / press.
                t += 2 * speed / ((1 - self.e) * press) if not self.block else self._both_sides(speed, t, piece, side)
                assert press > 1e-6, "the stop lets go too soon for the sum"
                self.rests.append(t)
                resting = True

    def _both_sides(self, speed: Any, t: Any, piece: int, side: int) -> Any:
        here, there = self._press(t, piece, side), self._press(t, piece, -side)
        return 2 * speed * (1 / here + self.e / there) / (1 - self.e**2)

    def _at_rest(self, side: int) -> Any:
        return mpf(0) if self.block else self.stops[0 if side > 0 else 1]

    def _press(self, t: Any, piece: int, side: int) -> Any:
        """Acceleration with which a body at a stop, or on a side, is pressed there."""
        # The side is also the direction away from the stop.
        weight = self.pull if self.block else side * self.pull
        return weight + side * (self.gain * self.motion_at(t, piece)[0] - self.k * self._at_rest(side))

    def _release(self, t: Any, piece: int, side: int) -> tuple[Any, int] | None:
        """When, and to which side, a body at rest leaves within the piece."""
        until, sides = self.breaks[piece], (1, -1) if self.block else (side,)
        while t < until:
            for each in sides:
                if self._press(t, piece, each) <= mpf(10) ** -40:
                    return t, each
            t += min(self._safe_rest(t, piece, each) for each in sides)
        return None

    def _safe_rest(self, t: Any, piece: int, side: int) -> Any:
        press, rate = self._press(t, piece, side), side * self.gain * self.motion_at(t, piece)[1]
        if "samples" in self.motion or not self.motion or piece > 0:
            return -press / rate if rate < 0 else self.end
        w = 2 * mp.pi * mpf(self.motion["frequency"])
        bend = _MARGIN * self.gain * mpf(self.motion["amplitude"]) * w * w
        return (rate + mp.sqrt(rate * rate + 2 * bend * press)) / bend

    def _arc(self, t: Any, x: Any, v: Any, piece: int, side: int) -> tuple[Any, Any, Any, int | None]:
        """Follow the body to the next impact, and which stop it is at, or to the end of the piece."""
        start, until = t, self.breaks[piece]
        base = self.particular(t, piece, side)
        difference = x - base[0], v - base[1]
        kicked = v == 0 and any(u == 0 for u, _, _ in self._distances(x, v, side))
        while True:
            fronts, largest = self._distances(x, v, side), self._largest_acceleration(abs(x), abs(v))
            for u, speed, stop in fronts:
                if t > start and u < mpf(10) ** -42 and speed < 0:
                    return t, self._at_rest(stop), v, stop
            # It leaves a rest with no speed: over its first tenth of a millisecond it moves away.
            h = mpf("1e-4") if kicked else min(
                (speed + mp.sqrt(speed * speed + 2 * largest * max(u, 0))) / largest for u, speed, _ in fronts
            )  # fmt: skip
            last, t = t, min(t + h, t + self._longest, until)
            at, free = self.particular(t, piece, side), self.free(*difference, t - start)
            x, v = at[0] + free[0], at[1] + free[1]
            assert not kicked or t == until or all(u > 0 for u, _, _ in self._distances(x, v, side))
            kicked = False
            if t == until:
                return t, x, v, None
            assert t > last

    def _distances(self, x: Any, v: Any, side: int) -> list[tuple[Any, Any, int]]:
        """Distance from each stop, its rate, and the side of the stop."""
        if self.block:
            return [(side * x, side * v, side)]
        ends = [(x - self.stops[0], v, 1)] if self.stops[0] is not None else []
        return ends + ([(self.stops[1] - x, -v, -1)] if self.stops[1] is not None else [])

    def _largest_acceleration(self, x: Any, v: Any) -> Any:
        """Bound over the next step, as long as the body hits no stop and does not overturn."""
        given, k = self.motion, abs(self.k)
        force = self.pull + self.gain * mpf(max(map(abs, given.get("samples", [given.get("amplitude", 0.0)]))))
        if k == 0:
            return force + mpf(10) ** -30
        if self.k > 0:
            return force + (self.pull if self.block else k * self.stops[1])
        # Without force x^2 + v^2/k does not grow, and a force adds F h to the speed in a step of h <= 1/sqrt(k).
        reach = x + v / mp.sqrt(k) + force / k
        return force + (k + self.c * mp.sqrt(k)) * reach
