"""A response in words for people, and in plain values for machines."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from rocking.response import data
from rocking.response.verdict import in_words
from rocking.tables import named, plain

if TYPE_CHECKING:
    from rocking.response.response import Response
    from rocking.response.sensitivity import Sensitivity

#: What drives a block (the motion, or the initial state) is taken to be known to this part of itself, about what the
#: usual record formats print: digits of times and of the peak that it would change are not shown.
KNOWN: Final = 1e-6

#: Events that a summary lists.
_LISTED: Final = 12
_MOST_DECIMALS, _MOST_DIGITS = 9, 6

#: From so much on, s, the unknown part of a time is told with it.
_TOLD: Final = 1e-3


def text(response: Response, friction: float | None) -> str:
    """Return what happened, line by line; with a coefficient of friction, whether it is enough."""
    known, gravity = response.sensitivity, response.block.gravity
    plus, minus = (threshold / gravity for threshold in response.block.uplift_thresholds(response.model))
    lines = [
        ("block", response.block.description),
        ("parameters", _parameters(response)),
        ("motion", _motion_text(response)),
        ("uplift above", f"{plus:.4f} g" if plus == minus else f"{plus:.4f} g (side +), {minus:.4f} g (side -)"),
        *_event_lines(response, known),
        ("impacts resolved", f"{len(response.impacts)}"),
        ("peak rotation", _peak_text(response, known)),
        ("friction needed", f"{response.required_friction:.4f}{_before_tipping(response)}"),
        ("least normal force", f"{response.minimum_normal_force:.4f} of the weight{_before_tipping(response)}"),
        *_contact_lines(response, friction),
        ("verdict", _verdict(response, known)),
    ]
    if any(" +- " in entry for _, entry in lines):
        lines.append(("+-", "what a millionth more or less of what drives the block changes"))
    return "\n".join(f"{name:<20}{entry}" for name, entry in lines)


def line(response: Response) -> str:
    """Return what happened, in one line."""
    shaken = "no motion" if response.motion is None else response.motion.label
    peak = "" if response.overturned else f", peak {response.peak_over_slenderness:.4f} of the slenderness"
    return (
        f"{response.block.description} under {shaken}: {in_words(response, f'{response.overturn_time:.4f} s')}{peak}; "
        f"{len(response.events)} events, {len(response.impacts)} impacts resolved, {response.duration:.5g} s"
    )


def values(response: Response, friction: float | None) -> dict[str, Any]:
    """Return the result for machines: plain values, units in the names, null where there is no number."""
    sides, motion = response.block.sides, response.motion
    ambiguities = response.ambiguities
    result: dict[str, Any] = plain(
        {
            "block": {
                "description": response.block.description,
                named("p", "rad/s"): [side.p for side in sides],
                named("alpha", "rad"): [side.alpha for side in sides],
                "restitution": [side.restitution for side in sides],
                named("gravity", "m/s^2"): response.block.gravity,
            },
            "motion": motion
            and {
                "name": motion.name,
                named("duration", "s"): motion.duration,
                named("pga", "m/s^2"): motion.pga,
                "history": motion.history,
                "vertical": motion.vertical
                and {"name": motion.vertical.name, named("pga", "m/s^2"): motion.vertical.pga},
            },
            "model": response.model,
            "chattering_treatment": repr(response.treatment),
            "overturned": response.overturned,
            "unfinished": response.unfinished,
            "stopped": response.stopped,
            named("overturn_time", "s"): response.overturn_time,
            named("tipping_time", "s"): response.tipping_time,
            named("peak_rotation", "rad"): response.peak_rotation,
            "peak_over_slenderness": response.peak_over_slenderness,
            named("peak_time", "s"): response.peak_time,
            "required_friction": response.required_friction,
            "minimum_normal_force_over_weight": response.minimum_normal_force,
            named("lift_off_time", "s"): response.lift_off_time,
            **_sliding(response, friction),
            "impacts_resolved": len(response.impacts),
            named("duration", "s"): response.duration,
            named("time_at_rest", "s"): response.time_at_rest,
            "ambiguous": bool(ambiguities),
            "ambiguities": ambiguities,
            "events": data.records(response, "events"),
            "chattering": data.records(response, "chattering"),
        }
    )
    return result


def time_text(time: float, change: float) -> str:
    """Time in s, as far as it is known where what drives the block is known to `KNOWN` of itself.

    Parameters
    ----------
    change : float
        Change of the time per relative change of what drives the block, s.

    Examples
    --------
    >>> time_text(230.726244377, 0.0), time_text(230.726244377, 3.0), time_text(230.726244377, 4e5)
    ('230.726244377 s', '230.72624 s', '230.7 +- 0.4 s')
    """
    unknown = KNOWN * change
    text = f"{time:.{_decimals(unknown)}f}"
    if not unknown >= _TOLD:
        return f"{text} s"
    return f"{text} +- {unknown:.1g} s" if unknown < 0.5 * time else f"about {text} s"


def _decimals(unknown: float) -> int:
    """Decimals of a number of which so much is unknown: of what is told, the one that is uncertain as well."""
    if not unknown > 0.0:
        return 0 if math.isnan(unknown) else _MOST_DECIMALS
    known = -math.log10(unknown)
    return min(max(math.ceil(known) if unknown >= _TOLD else math.floor(known), 0), _MOST_DECIMALS)


def _parameters(response: Response) -> str:
    sides = response.block.sides[:1] if response.block.is_symmetric else response.block.sides
    return "; ".join(map(str, sides))


def _motion_text(response: Response) -> str:
    motion = response.motion
    if motion is None:
        return "none: free rocking"
    gravity = response.block.gravity
    parts = [f"{motion.name}, {motion.duration:.2f} s, peak {motion.pga / gravity:.4f} g", *motion.history]
    if motion.vertical is not None:
        parts.append(f"vertical {motion.vertical.name}, peak {motion.vertical.pga / gravity:.4f} g")
    return "; ".join(parts)


def _event_lines(response: Response, known: Sensitivity) -> list[tuple[str, str]]:
    sequences = {float(row["end"]): row for row in response.chattering}
    changes = known.driving()[1]
    lines = []
    for event, change in zip(response.events[:_LISTED], changes, strict=False):
        entry = time_text(float(event["time"]), float(change))
        if event["kind"] == "uplift":
            entry += f", to side {'+' if event['side'] > 0 else '-'}"
        sequence = sequences.get(float(event["time"]))
        if event["kind"] == "rest" and sequence is not None:
            entry += _bracket_text(sequence, min(_decimals(KNOWN * change), 4))
        lines.append((str(event["kind"]), entry))
    if len(response.events) > _LISTED:
        lines.append(("...", f"{len(response.events) - _LISTED} more events"))
    return lines or [("uplift", "none")]


def _bracket_text(sequence: np.void, decimals: int) -> str:
    width = sequence["upper"] - sequence["lower"]
    if not width >= 0.0:
        return ", by the treatment, not proven"
    return f", complete chattering proven from {sequence['start']:.{decimals}f} s on, bracket {width:.1e} s wide"


def _peak_text(response: Response, known: Sensitivity) -> str:
    change = known.driving()[0]
    digits = _MOST_DIGITS
    if change > 0.0 and response.peak_rotation > 0.0:
        digits = min(max(math.floor(-math.log10(KNOWN * change / response.peak_rotation)), 1), _MOST_DIGITS)
    return (
        f"{response.peak_rotation:.{digits}g} rad at {response.peak_time:.4f} s, "
        f"{response.peak_over_slenderness:.{min(digits, 4)}g} of the slenderness"
    )


def _contact_lines(response: Response, friction: float | None) -> list[tuple[str, str]]:
    """Say whether the block slides at a coefficient of friction, and when its base leaves the ground if it does."""
    lines = []
    if friction is not None:
        sliding = response.sliding_time(friction)
        slides = "no" if math.isnan(sliding) else f"yes, first at {sliding:.4f} s; what follows is not this response"
        lines.append((f"slides at {friction:g}", slides))
    if not math.isnan(response.lift_off_time):
        lines.append(("base lifts off", f"at {response.lift_off_time:.4f} s; what follows is not this response"))
    return lines


def _sliding(response: Response, friction: float | None) -> dict[str, Any]:
    return (
        {} if friction is None else {"friction": friction, named("sliding_time", "s"): response.sliding_time(friction)}
    )


def _before_tipping(response: Response) -> str:
    return "" if math.isnan(response.tipping_time) else f", until it tips at {response.tipping_time:.4f} s"


def _verdict(response: Response, known: Sensitivity) -> str:
    changes = known.driving()[1]
    verdict = in_words(response, time_text(response.overturn_time, changes[-1]) if response.overturned else "")
    if response.stalled:
        verdict += f"; {response.stalled} rest(s) not proven"
    ambiguities = known.ambiguities(response.peak_rotation)
    if ambiguities:
        affected = {"peak": "the peak rotation", "events": "times of events"}
        verdict += (
            f"; AMBIGUOUS: one unit in the last place of the input changes "
            f"{' and '.join(affected[name] for name in ambiguities)}: scale the motion (or the initial state) "
            "by 1 plus some millionths, several times, and take the spread for the answer"
        )
    return verdict
