"""Periodic orbits in closed form, derived in docs/theory/orbits.md: amplitudes, folds, flips, and multipliers.

Nothing here comes from the package. Amplitudes are those of the acceleration of table, support or ground.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from scipy.optimize import fsolve


class Ball(NamedTuple):
    """A ball that hits the table once every n periods; levels are the table's peak acceleration over g."""

    restitution: float
    n: int

    @property
    def fold(self):
        """Level from which there is such an orbit."""
        e = self.restitution
        return self.n * math.pi * (1.0 - e) / (1.0 + e)

    @property
    def flip(self):
        """Level beyond which it is no longer stable."""
        e = self.restitution
        return math.hypot(self.fold, 2.0 * (1.0 + e * e) / (1.0 + e) ** 2)

    def trace(self, level, *, stable):
        """Sum of the multipliers, whose product is e^2."""
        e = self.restitution
        sine = math.sqrt(level * level - self.fold**2)
        return -2.0 * e + (1.0 + e) ** 2 * (1.0 - (sine if stable else -sine))


@dataclass(frozen=True)
class Oscillator:
    """An oscillator that hits its stop once every n periods.

    ``x'' + 2 z w0 x' + w0^2 x = -a(t)``, ``x >= -stop``; all orbits are numbered by k, so that the steady forced motion
    is stop + k below zero at the impact.
    """

    frequency: float
    restitution: float
    damping_ratio: float
    stop: float
    shaking: float
    n: int = 1

    def __post_init__(self):
        w0, w = 2.0 * math.pi * self.frequency, 2.0 * math.pi * self.shaking
        z, e, T = self.damping_ratio, self.restitution, self.n / self.shaking
        wd, d = w0 * math.sqrt(1.0 - z * z), z * w0
        E, C, S = math.exp(-d * T), math.cos(wd * T), math.sin(wd * T)
        # Free motion about the forced one: A = k at t = 0 and at T.
        B = (1.0 - E * C) / (E * S)
        first = -d + wd * B  # its velocity over k at 0
        last = E * ((-d + wd * B) * C - (d * B + wd) * S)
        beta = (first - last) / (1.0 + 1.0 / e)  # V = beta k
        gamma = (beta - first) / w  # velocity of the forced motion over w k
        values = {
            "w0": w0, "w": w, "d": d, "T": T, "beta": beta, "gamma": gamma,
            "diagonal": E * (2.0 * C), "corner": E * S / wd, "determinant": E * E * e * e,
        }  # fmt: skip
        for name, value in values.items():
            object.__setattr__(self, name, value)

    def amplitude(self, k):
        """Peak acceleration of the support at which there is the orbit k."""
        forced = math.hypot(self.stop + k, self.gamma * k)
        return forced * math.hypot(self.w0**2 - self.w**2, 2.0 * self.d * self.w)

    def speed(self, k):
        """Speed after the impact."""
        return self.beta * k

    def trace(self, k):
        """Sum of the multipliers."""
        return -self.restitution * self.diagonal + self.corner * self._jump(k)

    def _jump(self, k):
        """(e a- + a+)/v-: what the impact adds to the velocity per displacement; a is x'' before and after it."""
        e = self.restitution
        pushes = self.w**2 * self.stop - k * (self.w0**2 - self.w**2 - 2.0 * self.d * self.w * self.gamma)
        return -e * (1.0 + e) * pushes / self.speed(k)

    @property
    def fold(self):
        """Orbit k at which the amplitude is least."""
        return -self.stop / (1.0 + self.gamma**2)

    @property
    def flip(self):
        """Orbit k with a multiplier -1."""
        e = self.restitution
        wanted = (-1.0 - self.determinant + e * self.diagonal) / self.corner  # the jump
        rate = self.w0**2 - self.w**2 - 2.0 * self.d * self.w * self.gamma
        return self.w**2 * self.stop / (rate - wanted * self.beta / (e * (1.0 + e)))


@dataclass(frozen=True)
class Block:
    """A linear block that hits the ground once every half period, after m half periods with m odd.

    ``theta'' = p^2 (theta -+ alpha) - p^2 a(t)/g``; orbits are numbered by the speed V after the impact.
    """

    p: float
    alpha: float
    restitution: float
    shaking: float
    gravity: float
    m: int = 1

    @property
    def _h(self):
        return 0.5 * self.m / self.shaking

    @property
    def _w(self):
        return 2.0 * math.pi * self.shaking

    @property
    def _tau(self):
        return math.tanh(0.5 * self.p * self._h)

    def forced(self, speed):
        """Forced motion and its velocity over w at the impact onto side +."""
        e, p = self.restitution, self.p
        at = -0.5 * speed * (1.0 - e) / (e * p) * self._tau
        rate = (0.5 * speed * (1.0 + e) / e - p * self.alpha * self._tau) / self._w
        return at, rate

    def amplitude(self, speed):
        """Peak ground acceleration at which there is this orbit."""
        return math.hypot(*self.forced(speed)) * (self._w**2 + self.p**2) * self.gravity / self.p**2

    def trace(self, speed):
        """Sum of the multipliers of the map to the mirror image half a period later; their product is e^2."""
        e, p, h = self.restitution, self.p, self._h
        at, _ = self.forced(speed)
        jump = -p * p * self.alpha * (1.0 + e) - (1.0 - e) * (self._w**2 + p * p) * at
        return -2.0 * e * math.cosh(p * h) - math.sinh(p * h) / p * jump * e / speed

    def speed_with(self, trace):
        """Speed of the orbit with this sum of multipliers."""
        e, p, h = self.restitution, self.p, self._h
        at, _ = self.forced(1.0)
        known = trace + 2.0 * e * math.cosh(p * h) - math.sinh(p * h) / p * e * (1.0 - e) * (self._w**2 + p * p) * at
        return math.sinh(p * h) / p * e * p * p * self.alpha * (1.0 + e) / known

    @property
    def fold(self):
        """Speed at which a multiplier is 1."""
        return self.speed_with(1.0 + self.restitution**2)

    @property
    def breaking(self):
        """Speed at which a multiplier is -1: beyond it the orbit is no longer stable as a symmetric one."""
        return self.speed_with(-1.0 - self.restitution**2)

    @property
    def heteroclinic(self):
        """Peak ground acceleration from which courses lead from near the balance of a side to that of the other."""
        e, p, w = self.restitution, self.p, self._w
        forced = p * self.alpha * (1.0 - e) / math.hypot(p * (1.0 + e), w * (1.0 - e))
        return forced * (w**2 + p**2) * self.gravity / p**2

    def asymmetric(self, share, guess=None):
        """Amplitude, and the phase of an impact onto side +, of the orbit that is on that side for a share of the time.

        The arcs on both sides then last share T and (1 - share) T, T = m periods; without a guess, near the symmetric.
        """
        if guess is None:
            speed = self.breaking
            guess = self.amplitude(speed), math.atan2(self.forced(speed)[0], self.forced(speed)[1])

        def misses(unknown):
            (first, second), *_ = self._passed(share, *unknown)
            return first + second, (first - second) / (share - 0.5)

        found, *_ = fsolve(misses, guess, xtol=1e-13, full_output=True)
        assert np.max(np.abs(misses(found))) < 1e-9 * self.alpha * self.p, "no orbit was found"
        return found

    def _passed(self, share, amplitude, phase):
        """By how much the speeds at both impacts miss the law, the derivative over the period, and the first speed."""
        e, p, w = self.restitution, self.p, self._w
        forced = p * p * amplitude / (self.gravity * (w * w + p * p))
        starts, ends, change, time = [], [], np.eye(2), phase / w
        for sign, length in ((1.0, 2.0 * self._h * share), (-1.0, 2.0 * self._h * (1.0 - share))):
            after = time + length
            cosh, sinh = math.cosh(p * length), math.sinh(p * length)
            even = -self.alpha - sign * forced * math.sin(w * time)
            odd = -(self.alpha + sign * forced * math.sin(w * after) + even * cosh) / sinh
            starts.append(p * odd + sign * forced * w * math.cos(w * time))
            ends.append(p * (even * sinh + odd * cosh) + sign * forced * w * math.cos(w * after))
            push = p * p * amplitude / self.gravity * math.sin(w * after)
            before, beyond = -sign * p * p * self.alpha - push, sign * p * p * self.alpha - push
            jump = np.array([[e, 0.0], [(beyond - e * before) / (sign * ends[-1]), e]])
            change = jump @ np.array([[cosh, sinh / p], [p * sinh, cosh]]) @ change
            time = after
        return (starts[1] + e * ends[0], starts[0] + e * ends[1]), change, starts[0]

    @property
    def flip(self):
        """Orbit, not symmetric, with a multiplier -1: amplitude, phase of an impact onto side +, and speed after it."""

        def trace(share):
            return float(np.trace(self._passed(share, *known)[1])) + 1.0 + self.restitution**4

        low, high, known = 0.5, math.nan, None
        for share in np.arange(0.502, 0.9, 0.002):
            known = self.asymmetric(share, known)
            if trace(share) < 0.0:
                high = share
                break
            low = share
        for _ in range(50):
            share = 0.5 * (low + high)
            known = self.asymmetric(share, known)
            low, high = (share, high) if trace(share) > 0.0 else (low, share)
        amplitude, phase = known
        return float(amplitude), float(phase), float(self._passed(share, amplitude, phase)[2])
