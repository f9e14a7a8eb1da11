"""Scaling a ground motion: by a factor, or to a measure of its intensity."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Final

from rocking import checks
from rocking.constants import STANDARD_GRAVITY
from rocking.errors import InvalidMotion
from rocking.motion import measures
from rocking.motion.piecewise import Piecewise

#: What a motion is scaled to, in words, with its unit.
_MEASURES: Final = {
    "pga": ("peak ground acceleration", "m/s^2"),
    "pgv": ("peak ground velocity", "m/s"),
    "sa": ("spectral acceleration", "m/s^2"),
}


def factor_to(
    motion: Piecewise,
    targets: Mapping[str, float | None],
    period: float | None,
    damping: float | None,
) -> tuple[float, str]:
    """Factor that does what exactly one of the targets asks for, and the sentence for the motion's history.

    Parameters
    ----------
    targets
        "factor", "pga" (m/s^2), "pgv" (m/s), "sa" (m/s^2); None is not asked for.
    period, damping
        Oscillator of "sa", s and fraction of critical; both go with it alone.

    Raises
    ------
    InvalidMotion
        If not exactly one is asked for, an argument is out of place or out of range, or the motion is zero throughout.
    """
    given = {what: value for what, value in targets.items() if value is not None}
    if len(given) != 1:
        raise InvalidMotion("scale a motion by exactly one of factor, pga, pgv and sa (with period)")
    ((what, wanted),) = given.items()
    if (what == "sa") != (period is not None):
        raise InvalidMotion("period= (s) goes with sa=, and only with it")
    if what != "sa" and damping is not None:
        raise InvalidMotion(f"damping= belongs to sa= and period=, not to {what}=")
    if what == "factor":
        factor = checks.finite(wanted, "scale factor", InvalidMotion)
        return factor, f"scaled by {factor:.6g}"
    words, unit = _MEASURES[what]
    ratio = measures.DAMPING if damping is None else damping
    level = checks.positive(wanted, what, InvalidMotion, unit)
    now = measures.target(motion, what, period, ratio)
    if now == 0.0:
        raise InvalidMotion(f"a motion that is zero throughout cannot be scaled to a {words}")
    in_g = f" ({level / STANDARD_GRAVITY:.4g} g)" if unit == "m/s^2" else ""
    oscillator = f" at {period:.6g} s, damping {ratio:.6g}" if what == "sa" else ""
    return level / now, f"scaled by {level / now:.6g} to a {words} of {level:.6g} {unit}{in_g}{oscillator}"
