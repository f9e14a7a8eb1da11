"""Critical scale of a motion, at which a block begins to overturn, with its derivatives."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import partial
from typing import Final

from rocking.block.body import Body
from rocking.core import checks
from rocking.core.bisection import bisect
from rocking.core.constants import Model
from rocking.errors import OptionError
from rocking.motion.motion import Motion
from rocking.records.named import check_motion
from rocking.response import Gradient, gradient
from rocking.simulation.simulate import simulate

_NO_BALANCE: Final = (
    "the outcome changes without the block coming to the balance point: by a touch of the ground without speed, or at "
    "a rest"
)


@dataclass(frozen=True)
class CriticalScale:
    """Critical scale of a motion with its derivatives, computed by `critical_scale`.

    Attributes
    ----------
    scale : float
        Smallest floating-point scale that overturns the block, next to a scale that does not.
    gradient : Gradient
        Derivatives with respect to the unscaled motion and the initial state, with the scale in `Gradient.value`. If
        the outcome changes although the block does not reach the balance point, all derivatives are NaN, and
        `Gradient.reason` explains this.
    p_derivative, alpha_derivative, restitution_derivative : float
        Derivatives with respect to relative changes of these parameters on both sides. Times 1e-3, they are changes of
        the scale for 0.1 %.

    See Also
    --------
    rocking.gradient : Compute derivatives of a response.

    Examples
    --------
    >>> import rocking
    >>> block = rocking.Block.from_parameters(p=2.0, alpha=0.2, restitution=0.9)
    >>> record = rocking.Motion.from_samples([0.0, 3.0, -4.0, 3.0, 0.0], 0.3)
    >>> critical = rocking.critical_scale(block, record, (2.0, 6.0))
    >>> f"scale {critical.scale:.4f}, +0.1 % of p {1e-3 * critical.p_derivative:+.4f}"
    'scale 3.2561, +0.1 % of p -0.0023'
    """

    scale: float
    gradient: Gradient
    p_derivative: float
    alpha_derivative: float
    restitution_derivative: float


def critical_scale(
    block: Body,
    motion: Motion,
    bounds: tuple[float, float],
    *,
    model: Model = "nonlinear",
    initial_rotation: float = 0.0,
    initial_velocity: float = 0.0,
) -> CriticalScale:
    """Find a critical scale of a motion, at which a block begins to overturn, and its derivatives.

    Parameters
    ----------
    block : Block
        Block, or another body that can overturn.
    motion : Motion
        Motion, both components of which are scaled.
    bounds : (float, float)
        Positive scales that bracket the critical scale: the block stands at the lower one and overturns at the higher
        one. If the outcome changes several times between them, one of the changes is found.
    model, initial_rotation, initial_velocity : optional
        As for `simulate`.

    Returns
    -------
    CriticalScale
        Scale, and derivatives with respect to every sample, the initial state and the block's parameters.

    Raises
    ------
    MotionError
        If `motion` is not a `Motion`.
    OptionError
        If there is no motion, the block overturns at the lower scale or stands at the higher one, or the scales are not
        positive and increasing.

    See Also
    --------
    rocking.incremental_dynamic_analysis : Find all bands of levels that overturn.
    rocking.gradient : Compute derivatives of a response.

    Notes
    -----
    At the critical scale the response approaches the balance point and stays there. The derivatives follow from the
    implicit function theorem (see "Impacts: restitution and sensitivity" in the documentation).

    Examples
    --------
    >>> import rocking
    >>> block = rocking.Block.from_parameters(p=2.0, alpha=0.2, restitution=0.9)
    >>> record = rocking.Motion.from_samples([0.0, 3.0, -4.0, 3.0, 0.0], 0.3)
    >>> f"{rocking.critical_scale(block, record, (2.0, 6.0)).scale:.6f}"
    '3.256134'
    """
    if check_motion(motion) is None:
        raise OptionError("a critical scale requires a {}; got None", "motion")
    low, high = checks.increasing_pair(bounds, "bounds", OptionError)
    checks.positive(low, "bounds", OptionError)

    run = partial(simulate, block, model=model, initial_rotation=initial_rotation, initial_velocity=initial_velocity)
    for bound, expected in ((low, False), (high, True)):
        if run(motion * bound).overturned is not expected:
            behaviour, correction = ("does not overturn", "raise") if expected else ("overturns", "lower")
            message = f"the block {behaviour} at the scale {bound:g}: {correction} it in {{}}"
            raise OptionError(message, "bounds", value=bounds)
    _, scale = bisect(low, high, lambda scale: run(motion * scale).overturned)
    response = run(motion * scale)
    derivatives = response.sensitivity.events
    by_scale, *by_block = (float(derivatives[name][-1]) for name in ("motion", "p", "alpha", "restitution"))
    event_gradient, scale_change = gradient(response, "event", -1), -scale / by_scale
    reason = event_gradient.reason
    if not abs(by_scale) > 1e6:
        reason, scale_change = _NO_BALANCE, math.nan
    motion_gradient = replace(
        event_gradient,
        value=scale,
        coefficients=scale * scale_change * event_gradient.coefficients,
        vertical=None if event_gradient.vertical is None else scale * scale_change * event_gradient.vertical,
        initial_rotation=scale_change * event_gradient.initial_rotation,
        initial_velocity=scale_change * event_gradient.initial_velocity,
        reason=reason,
        motion=motion,
    )
    return CriticalScale(scale, motion_gradient, *(scale_change * derivative for derivative in by_block))
