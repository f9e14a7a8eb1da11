"""A response in words for people, and in plain values for machines."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from rocking.response import data, digits
from rocking.response.verdict import in_words
from rocking.tables import counted, named, plain

if TYPE_CHECKING:
    from rocking.response.response import Response
    from rocking.response.sensitivity import Sensitivity

#: Events that a summary lists.
_LISTED: Final = 12


def text(response: Response, friction: float | None) -> str:
    """Return what happened, line by line; with a coefficient of friction, whether it is enough."""
    return "\n".join(f"{name:<20}{entry}" for name, entry in rows(response, friction))


def rows(response: Response, friction: float | None) -> list[tuple[str, str]]:
    """Return the rows of `text`: what, and how much."""
    known = response.sensitivity
    sliding = math.nan if friction is None else response.sliding_time(friction)
    lines = [
        ("block", response.block.description),
        ("parameters", _parameters(response)),
        ("motion", _motion_text(response)),
        ("uplift above", _thresholds_text(response)),
        *_event_lines(response, known),
        ("impacts resolved", f"{len(response.impacts)}"),
        ("peak rotation", _peak_text(response)),
        ("friction needed", f"{response.required_friction:.4f}{_before_tipping(response)}"),
        ("least normal force", f"{response.minimum_normal_force:.4f} of the weight{_before_tipping(response)}"),
        *_contact_lines(response, friction, sliding),
        ("verdict", _verdict(response, known) + ("" if math.isnan(sliding) else " (as if it did not slide)")),
    ]
    if any(" +- " in entry for _, entry in lines):
        lines.append(("+-", "what a millionth more or less of what drives the block changes"))
    return lines


def line(response: Response) -> str:
    """Return what happened, in one line."""
    shaken = "no motion" if response.motion is None else response.motion.label
    peak = "" if response.overturned else f", peak {response.peak_over_slenderness:.4g} of the slenderness"
    return (
        f"{response.block.description} under {shaken}: {in_words(response, f'{response.overturn_time:.4f} s')}{peak}; "
        f"{counted(len(response.events), 'event')}, {counted(len(response.impacts), 'impact')} resolved, "
        f"{response.duration:.5g} s"
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


def _thresholds_text(response: Response) -> str:
    """Say what lifts the block; under a vertical motion it changes with the weight."""
    gravity, motion = response.block.gravity, response.motion
    plus, minus = (threshold / gravity for threshold in response.block.uplift_thresholds(response.model))
    text = f"{plus:.4f} g" if plus == minus else f"{plus:.4f} g (side +), {minus:.4f} g (side -)"
    if motion is None or motion.vertical is None:
        return text
    low, high = (1.0 + lift / gravity for lift in motion.vertical.extremes)
    return f"{text}, times the weight over that at rest, {low:.4f} to {high:.4f}"


def _event_lines(response: Response, known: Sensitivity) -> list[tuple[str, str]]:
    sequences = {float(row["end"]): row for row in response.chattering}
    changes = known.driving()[1]
    lines = []
    for event, change in zip(response.events[:_LISTED], changes, strict=False):
        time = float(event["time"])
        entry = digits.time_text(time, float(change))
        sequence = sequences.get(time)
        if event["kind"] == "uplift":
            entry += f", to side {'+' if event['side'] > 0 else '-'}"
        elif event["kind"] == "rest" and sequence is not None:
            entry = _rest_text(response, time, float(change), sequence)
        lines.append((str(event["kind"]), entry))
    if len(response.events) > _LISTED:
        lines.append(("...", f"{len(response.events) - _LISTED} more events"))
    return lines or [("uplift", "none")]


def _rest_text(response: Response, time: float, change: float, sequence: np.void) -> str:
    """Say when the block comes to rest, and how that is known: no more of it than the record's digits tell."""
    unknown, width = digits.KNOWN * change, sequence["upper"] - sequence["lower"]
    decimals = digits.decimals(unknown)
    if unknown < digits.TOLD:
        text = digits.time_text(time, change)
        if not width >= 0.0:
            return f"{text}, by the treatment, not proven"
        start = f"{sequence['start']:.{min(decimals, 4)}f}"
        # The bracket is for the motion to the last place: beside a time with fewer digits it would say too much.
        bracket = f", bracket {width:.1e} s wide" if decimals >= digits.MOST_DECIMALS else ""
        return f"{text}, complete chattering proven from {start} s on{bracket}"
    driver = "the initial state" if response.motion is None else "the motion"
    off = f"+- {unknown:.1g} s" if unknown < 0.5 * time else "far from it"
    known = "rest proven" if width >= 0.0 else "by the treatment, not proven"
    return f"at about {time:.{decimals}f} s ({off} if {driver} is off by a millionth); {known}"


def _peak_text(response: Response) -> str:
    reached = f"{digits.peak_text(response)} at {digits.peak_time_text(response)}"
    if response.overturned:
        return f"{reached}, where the block has fallen"
    return f"{reached}, {digits.ratio_text(response)} of the slenderness"


def _before_tipping(response: Response) -> str:
    return "" if math.isnan(response.tipping_time) else f", until it tips at {digits.tipping_text(response)}"


def _contact_lines(response: Response, friction: float | None, sliding: float) -> list[tuple[str, str]]:
    """Say whether the block slides at a coefficient of friction, and when its base leaves the ground if it does."""
    lines = []
    if friction is not None:
        text = (
            "is enough: the block does not slide"
            if math.isnan(sliding)
            else f"is not enough: the block slides, first at {sliding:.4f} s; what follows is not this response"
        )
        lines.append((f"friction {friction:g}", text))
    if not math.isnan(response.lift_off_time):
        lines.append(("base lifts off", f"at {response.lift_off_time:.4f} s; what follows is not this response"))
    return lines


def _sliding(response: Response, friction: float | None) -> dict[str, Any]:
    return (
        {} if friction is None else {"friction": friction, named("sliding_time", "s"): response.sliding_time(friction)}
    )


def _verdict(response: Response, known: Sensitivity) -> str:
    verdict = in_words(response, digits.overturn_text(response) if response.overturned else "")
    if response.stalled:
        verdict += f"; {counted(response.stalled, 'rest')} not proven"
    ambiguities = known.ambiguities(response.peak_rotation, response.near_ties)
    if ambiguities:
        affected = {
            "peak": "the peak rotation",
            "events": "times of events or impacts",
            "touch": "whether a block without weight touches the ground",
        }
        verdict += (
            f"; AMBIGUOUS: one unit in the last place of the input changes "
            f"{' and '.join(affected[name] for name in ambiguities)}: scale the motion (or the initial state) "
            "by 1 plus some millionths, several times, and take the spread for the answer"
        )
    return verdict
