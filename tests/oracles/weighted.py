"""An arc under a push and a weight that change evenly: by its Taylor series in 60-digit arithmetic."""

from typing import Any, NamedTuple

from mpmath import MPContext

mp = MPContext()
mp.dps = 60
NEGLIGIBLE = mp.mpf("1e-50")
ORDER = 64
Number = Any
Line = tuple[float, float]


class Arc(NamedTuple):
    """A side that is leant to, its rotation and velocity, and what acts on it (value in g, rate in g/s)."""

    nonlinear: bool
    p: float
    alpha: float
    u: float
    v: float
    push: Line
    weight: Line

    def after(self, t: float) -> tuple[Number, Number]:
        """Rotation and velocity after t, which is no more than a few times 1/p."""
        t = mp.mpf(t)
        c = self.coefficients(t)
        assert max(abs(c[-1]), abs(c[-2]), abs(c[-3])) <= NEGLIGIBLE * max(abs(x) for x in c)
        return sum(c), sum(k * x for k, x in enumerate(c)) / t

    def coefficients(self, t: Number) -> list[Number]:
        """Coefficients of the rotation, time counted in t."""
        stiffness = (mp.mpf(self.p) * t) ** 2
        a = (mp.mpf(self.push[0]), mp.mpf(self.push[1]) * t)
        w = (mp.mpf(self.weight[0]), mp.mpf(self.weight[1]) * t)
        c = [mp.mpf(self.u), mp.mpf(self.v) * t]
        psi = mp.mpf(self.alpha) - c[0]
        sine, cosine = [mp.sin(psi)], [mp.cos(psi)]
        for k in range(ORDER):
            if self.nonlinear:
                pull = sum(w[j] * sine[k - j] + a[j] * cosine[k - j] for j in range(min(k, 1) + 1))
                turns = [(j + 1) * c[j + 1] for j in range(k + 1)]
                sine.append(-sum(turns[j] * cosine[k - j] for j in range(k + 1)) / (k + 1))
                cosine.append(sum(turns[j] * sine[k - j] for j in range(k + 1)) / (k + 1))
            else:
                heights = [(mp.mpf(self.alpha) if i == 0 else 0) - c[i] for i in range(max(0, k - 1), k + 1)]
                pull = w[0] * heights[-1] + (w[1] * heights[-2] if k else 0) + (a[k] if k < 2 else 0)
            c.append(-stiffness * pull / ((k + 1) * (k + 2)))
        return c
