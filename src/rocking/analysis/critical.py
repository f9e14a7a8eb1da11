"""The scale of a motion at which a block overturns, and how it changes with the motion, the start and the block."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Final

from rocking.block.body import Body
from rocking.core import checks
from rocking.core.bisection import bisected
from rocking.core.constants import Model
from rocking.errors import InvalidOption
from rocking.motion.motion import Motion
from rocking.records.named import one_motion
from rocking.response import Gradient, Response, gradient
from rocking.simulation.simulate import simulate

_NO_BALANCE: Final = (
    "the outcome changes without the block coming to the balance point: by a touch of the ground without speed, or at "
    "a rest"
)


@dataclass(frozen=True)
class CriticalScale:
    """Where a block begins to overturn along the scale of a motion, with derivatives; made by `critical_scale`.

    Attributes
    ----------
    scale : float
        The least scale, to the last digit, that overturns the block, next to one that does not.
    gradient : Gradient
        Its derivatives by the motion as it was given (unscaled) and by the start, per unit of each; `Gradient.value` is
        the scale. Where the outcome changes there without the block coming to the balance point, all derivatives are
        NaN, and `Gradient.reason` says so.
    p, alpha, restitution : float
        Its change per relative change of these of both sides together: times 1e-3 it is that by 0.1 % more.
    """

    scale: float
    gradient: Gradient
    p: float
    alpha: float
    restitution: float


def critical_scale(
    block: Body,
    motion: Motion,
    low: float,
    high: float,
    *,
    model: Model = "nonlinear",
    initial_rotation: float = 0.0,
    initial_velocity: float = 0.0,
) -> CriticalScale:
    """Find a scale of a motion at which a block begins to overturn, and its derivatives.

    Parameters
    ----------
    block : Block
        Block, or another body that can overturn.
    motion : Motion
        Motion that is scaled, both components alike.
    low, high : float
        Positive scales between which it is: the block stands at the lower one and overturns at the higher one. Where
        the outcome changes several times between them, one of the changes is found.
    model, initial_rotation, initial_velocity : optional
        As for `simulate`.

    Returns
    -------
    CriticalScale
        The scale, and derivatives by every sample, the start and the block's parameters.

    Raises
    ------
    InvalidMotion
        If the motion is no `Motion`.
    InvalidOption
        If there is none, the block overturns at the lower scale, or not at the higher one, or the scales are not
        positive and in this order.

    Notes
    -----
    At the critical scale the response comes to the balance point and stays. The derivatives follow by the implicit
    function theorem: see "Impacts: restitution and sensitivity" in the documentation.

    Examples
    --------
    >>> import rocking
    >>> block = rocking.Block.from_parameters(p=2.0, alpha=0.2, restitution=0.9)
    >>> record = rocking.Motion.from_samples([0.0, 3.0, -4.0, 3.0, 0.0], 0.3)
    >>> f"{rocking.critical_scale(block, record, 2.0, 6.0).scale:.6f}"
    '3.256134'
    """
    if one_motion(motion) is None:
        raise InvalidOption("there is no {} to scale: give one", "motion")
    least, most = (checks.positive(value, name, InvalidOption) for value, name in ((low, "low"), (high, "high")))
    if least >= most:
        raise InvalidOption(f"{{}} = {least:g} must be below {{}} = {most:g}", "low", "high", value=low)

    def response(scale: float) -> Response:
        return simulate(
            block, motion * scale, model=model, initial_rotation=initial_rotation, initial_velocity=initial_velocity
        )

    for value, name, expected in ((least, "low", False), (most, "high", True)):
        if response(value).overturned is not expected:
            does, wanted = ("does not overturn", "raise") if expected else ("overturns", "lower")
            raise InvalidOption(f"the block {does} at the scale {{}} = {value:g}: {wanted} it", name, value=value)
    _, scale = bisected(least, most, lambda scale: response(scale).overturned)
    last = response(scale)
    by_scale = {name: float(last.sensitivity.events[name][-1]) for name in ("motion", "p", "alpha", "restitution")}
    turned, share = gradient(last, "event", -1), -scale / by_scale["motion"]
    reason = turned.reason
    if not abs(by_scale["motion"]) > 1e6:
        reason, share = _NO_BALANCE, math.nan
    by_motion = replace(
        turned,
        value=scale,
        coefficients=scale * share * turned.coefficients,
        vertical=None if turned.vertical is None else scale * share * turned.vertical,
        initial_rotation=share * turned.initial_rotation,
        initial_velocity=share * turned.initial_velocity,
        reason=reason,
        motion=motion,
    )
    p, alpha, restitution = (share * by_scale[name] for name in ("p", "alpha", "restitution"))
    return CriticalScale(scale, by_motion, p, alpha, restitution)
