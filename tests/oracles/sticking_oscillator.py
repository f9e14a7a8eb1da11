"""Chattering of an undamped oscillator with one stop, in Budd and Dux's numbers: x'' + x = cos(w t), x < sigma.

Nothing here comes from the package. With u = sigma - x >= 0 the mass is pressed against the stop by
q(t) = cos(w t) - sigma, and rests there while q > 0. A period ends, here, when q passes zero on its way down: then the
mass leaves. Arcs are in closed form, and impacts are followed one by one in mpmath's precision: a time s before the end
arcs have heights of s^3, so that double precision ends at s = 1e-5.
"""

from __future__ import annotations

from typing import NamedTuple

import mpmath as mp

#: Longest step in which an arc is looked at for its end, and most of the rest of a sequence over the time that is left.
_LOOK = 0.1
_SHORT = 0.25


class Oscillator(NamedTuple):
    """Restitution, place of the stop, and frequency of the forcing."""

    restitution: float
    sigma: float
    frequency: float

    @property
    def release(self):
        """Time at which the mass leaves the stop."""
        return mp.acos(self.sigma) / self.frequency

    @property
    def end(self):
        """Time at which it would leave again."""
        return self.release + 2 * mp.pi / self.frequency

    def pressing(self, time):
        """Acceleration towards the stop, at the stop."""
        return mp.cos(self.frequency * time) - self.sigma

    def arc(self, start, speed):
        """Distance from the stop and its rate as functions of the time since the start."""
        w = mp.mpf(self.frequency)
        gain = 1 / (1 - w * w)
        even, odd = gain * mp.cos(w * start) - self.sigma, speed - gain * w * mp.sin(w * start)

        def state(h):
            (cosine, sine), (forced, rate) = mp.cos_sin(h), mp.cos_sin(w * (start + h))
            return (
                self.sigma - gain * forced + even * cosine + odd * sine,
                gain * w * rate - even * sine + odd * cosine,
            )

        return state

    def impact_after(self, start, speed):
        """Length of the arc and the speed that ends it; None where the arc outlasts the period."""
        state, left, push = self.arc(start, speed), self.end - start, self.pressing(start)
        look = min(mp.mpf(_LOOK), speed / push) if push > 0 and speed > 0 else mp.mpf(_LOOK)
        low, high = mp.mpf(0), look
        while state(high)[0] > 0:
            if high >= left:
                return None
            low, high = high, min(high + look, left)
        if low == 0:
            raise AssertionError("an arc is shorter than a steady push allows")
        h = low
        for _ in range(400):
            distance, rate = state(h)
            low, high = (h, high) if distance > 0 else (low, h)
            better = h - distance / rate
            if not low < better < high:
                better = (low + high) / 2
            if abs(better - h) < mp.eps**0.9 * h:
                return better, -state(better)[1]
            h = better
        raise AssertionError("no root was found")

    def impacts(self):
        """Time of each impact and the speed after it, up to the end of the period or for ever."""
        time, speed = self.release, mp.mpf(0)
        while (found := self.impact_after(time, speed)) is not None:
            time, speed = time + found[0], self.restitution * found[1]
            yield time, speed

    def remaining(self, time, speed):
        """Time that a steady push would take to bring the mass to rest; infinity where it is not pressed."""
        push = self.pressing(time)
        return 2 * speed / (push * (1 - mp.mpf(self.restitution))) if push > 0 else mp.inf

    def rest(self, width):
        """Time of rest, from impacts up to one after which little time is left; the push changes within that."""
        for time, speed in self.impacts():
            left = self.remaining(time, speed)
            if left < width:
                return time + left
        return None

    def is_complete(self):
        """Whether the sequence dies out before the end: what is left of it is short beside the time to the end."""
        return any(self.remaining(time, speed) < _SHORT * (self.end - time) for time, speed in self.impacts())
