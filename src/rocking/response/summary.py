"""Text summaries of a response, with the digits that are known."""

from __future__ import annotations

import math
from typing import Final

import numpy as np

from rocking.block import Block, RestrainedBlock
from rocking.block.sides import format_sides
from rocking.core.constants import STANDARD_GRAVITY
from rocking.core.result import Row
from rocking.core.tables import format_count
from rocking.engine.problem import compute_uplift_thresholds
from rocking.response.perturbed import choose_factors, format_percent
from rocking.response.simulated import ResponseData

#: Largest numbers of decimals of a time and digits of a peak, and digits of a range of peaks.
_MAX_DECIMALS: Final = 9
_MAX_DIGITS: Final = 6
_MIN_DIGITS: Final = 3

#: Decimals of a time in a table, and next to other values in a summary.
_ROW_DECIMALS: Final = 2
_SHORT_DECIMALS: Final = 4

#: Smallest range of a time, s, that is reported.
_MIN_RANGE: Final = 1e-3

#: Largest number of events in a summary.
_MAX_EVENTS: Final = 12

#: Unknown results of an ambiguous response.
_AMBIGUITIES: Final = {
    "peak": "the peak rotation",
    "events": "times of events or impacts",
    "touch": "whether the body lifts off, touches the ground or falls from its balance",
}


def create_rows(response: ResponseData, available_friction: float | None, precision: float) -> list[Row]:
    """Return the rows of a summary, including the check of an available friction if given."""
    body = response.block
    sliding = math.nan if available_friction is None else response.sliding_time(available_friction)
    rows = [
        Row("block" if isinstance(body, Block) else "body", body.description),
        Row("parameters", format_sides(body.sides)),
        *([Row("balance", _describe_balance(response))] if isinstance(body, RestrainedBlock) else []),
        Row("motion", _summarise_motion(response)),
        Row("uplift above", _describe_thresholds(response)),
        *_create_event_rows(response),
        Row("impacts resolved", f"{len(response.impacts)}"),
        *_create_peak_rows(response),
        *([Row(f"residual {body.coordinate.name}", _format_residual(response))] if response.leans else []),
    ]
    for row in response.tendons:
        plastic_text = f", {1e3 * row['plastic_elongation']:.4g} mm of it for good" if row["plastic_elongation"] else ""
        text = f"longer by {1e3 * row['elongation']:.4g} mm at most{plastic_text}"
        rows.append(Row("tendon", text, note=f", force {1e-3 * row['force']:.4g} kN at most"))
    if isinstance(body, RestrainedBlock) and body.contact_law is None:
        rows.append(Row("friction, lift-off", "not judged: the forces of the ground are not known"))
    if body.contact_law is not None:
        until = "" if math.isnan(response.tipping_time) else f", until it tips at {format_tipping_time(response)}"
        rows += [
            Row("friction needed", f"{response.required_friction:.4f}", note=until),
            Row("least normal force", f"{response.minimum_normal_force:.4f}", "of the weight", until),
        ]
        end_of_validity = "what follows is not this response"
        if response.friction is not None:
            static, kinetic = response.friction
            text = f"{static:g}" if static == kinetic else f"{static:g} (static), {kinetic:g} (kinetic)"
            rows.append(Row("friction", text))
            slip = f"{1e3 * response.largest_slip:.4g} mm at most" if response.slips else "none"
            residual = f", {1e3 * response.residual_slip:.4g} mm at the end" if response.slips else ""
            rows.append(Row("slip", slip, note=residual))
        if available_friction is not None:
            text = f"is not enough: the block slides, first at {sliding:.4f} s; {end_of_validity}"
            text = "is enough: the block does not slide" if math.isnan(sliding) else text
            rows.append(Row(f"friction {available_friction:g}", text))
        if not math.isnan(response.lift_off_time):
            rows.append(Row("base lifts off", f"at {response.lift_off_time:.4f} s; {end_of_validity}"))
    perturbed = response.perturbed()
    max_spread = np.max(np.nan_to_num(perturbed.event_spreads, nan=math.inf), initial=0.0)
    if max_spread >= _MIN_RANGE or _count_peak_digits(response) < _MIN_DIGITS:
        rows.append(Row("ranges", f"those of the {perturbed.sample_text}; other factors can lead beyond them"))
    without_sliding = "" if math.isnan(sliding) else " (as if it did not slide)"
    rows.append(Row("outcome", _describe_outcome(response), note=without_sliding))
    return [*rows, Row("", response.perturbed(*choose_factors(precision)).describe_agreement())]


def describe_subject(response: ResponseData) -> str:
    """Return the body and its motion as text."""
    return f"{response.block.description} under {'no motion' if response.motion is None else response.motion.label}"


def format_line(response: ResponseData) -> str:
    """Return the response in one line."""
    limit, peak = response.block.coordinate.limit_name, ""
    if limit and not response.overturned and math.isfinite(response._balance_at_peak):
        peak = f", peak {format_ratio(response)} of the {limit}"
    outcome = format_outcome(response, f"{response.overturn_time:.4f} s")
    counts = f"{format_count(len(response.events), 'event')}, {format_count(len(response.impacts), 'impact')} resolved"
    return f"{describe_subject(response)}: {outcome}{peak}; {counts}, {response.duration:.5g} s"


def format_outcome(response: ResponseData, overturn_time: str) -> str:
    """Return the outcome for the summary. The time of overturning is passed as text."""
    if response.overturned:
        return f"overturns at {overturn_time}"
    if response.unfinished:
        return f"UNFINISHED: given up at {response.duration:.4f} s, after too many steps"
    if response.lost_contact:
        return f"loses contact with the ground at {response.duration:.4f} s, where the simulation ends"
    if response.ended_early:
        motion_end = 0.0 if response.motion is None else response.motion.end
        to_come = f"; the motion goes on to {motion_end:.6g} s" if response.duration < motion_end else ""
        return f"{_describe_stop(response)}, where the simulation was stopped{to_come}"
    if response.leans and response.block.coordinate.limit_name:
        return f"does not overturn: it stays leaning, at {_format_residual(response)}"
    if not response.moved:
        return "does not move"
    if response.slips and response.peak_rotation == 0.0:
        return "slides and does not rock"
    return "rocks and does not overturn" if response.block.coordinate.limit_name else "moves, and comes to rest"


def format_brief_outcome(response: ResponseData, precision: float) -> str:
    """Return the outcome for a row of a table."""
    perturbed, within_precision = response.perturbed(), response.perturbed(*choose_factors(precision))
    counts_overturned = not perturbed.is_decided and perturbed.overturned.any()
    text = perturbed.outcome if perturbed.is_decided else f"undecided: {perturbed.outcome}"
    if counts_overturned:
        text = "undecided: overturns"
    if response.overturned and perturbed.is_decided:
        time = _format_short_time(response.overturn_time, *perturbed.overturn_range, max_decimals=_ROW_DECIMALS)
        text += f" at {time}"
    elif response.leans:
        text += f" at {_format_residual(response)}"
    elif response.ended_early:
        text = _describe_stop(response) if perturbed.is_decided else text
    parts = []
    for repeats in (perturbed, within_precision):
        count = int(repeats.overturned.sum()) if counts_overturned else len(repeats.agreeing_repeats)
        parts.append(f"{count} of {len(repeats.repeats)} ({format_percent(repeats.max_deviation)})")
    return f"{text} in {', '.join(parts)}{', AMBIGUOUS' if response.ambiguous else ''}"


def _format_residual(response: ResponseData) -> str:
    """Return the residual rotation, which depends on the peak if a tendon has yielded."""
    return f"{response.residual_rotation:.{_count_peak_digits(response)}g} {response.block.coordinate.unit}"


def format_ratio(response: ResponseData) -> str:
    """Return the normalised peak rotation with the known digits."""
    return f"{response.peak_over_slenderness:.{min(_count_peak_digits(response), 4)}g}"


def round_ratio(response: ResponseData) -> float:
    """Return the normalised peak rotation, rounded if fewer than four digits are known."""
    is_known = _count_peak_digits(response) >= _SHORT_DECIMALS
    return response.peak_over_slenderness if is_known else float(format_ratio(response))


def format_time(time: float, low: float, high: float) -> str:
    """Return a time, s, with the digits common to its range, or its range if wide."""
    uncertainty = _compute_uncertainty(time, low, high)
    decimals = _count_decimals(uncertainty)
    is_narrow = uncertainty < _MIN_RANGE
    return f"{time:.{decimals}f} s" if is_narrow else f"{low:.{decimals}f} to {high:.{decimals}f} s"


def format_tipping_time(response: ResponseData) -> str:
    """Return the tipping time with the known digits, which equal the ones of the overturning time."""
    uncertainty = 0.0
    if response.overturned:
        uncertainty = _compute_uncertainty(response.overturn_time, *response.perturbed().overturn_range)
    prefix = "" if uncertainty < _MIN_RANGE else "about "
    return f"{prefix}{response.tipping_time:.{min(_count_decimals(uncertainty), _SHORT_DECIMALS)}f} s"


def _summarise_motion(response: ResponseData) -> str:
    """Describe the ground motion. In all texts g is standard gravity."""
    motion = response.motion
    if motion is None:
        return "none: free rocking"
    parts = [f"{motion.name}, {motion.duration:.2f} s, peak {motion.pga / STANDARD_GRAVITY:.4f} g", *motion.history]
    if motion.vertical is not None:
        parts.append(f"vertical {motion.vertical.name}, peak {motion.vertical.pga / STANDARD_GRAVITY:.4f} g")
    return "; ".join(parts)


def _describe_thresholds(response: ResponseData) -> str:
    """Return the uplift thresholds, which vary with the weight under vertical motion."""
    motion = response.motion
    (pair,), (weight_part,) = compute_uplift_thresholds(response.block.as_bodies(), response.model)
    plus, minus = (pair / STANDARD_GRAVITY).tolist()
    is_single = plus == minus or math.isinf(minus)
    text = f"{plus:.4f} g" if is_single else f"{plus:.4f} g (side +), {minus:.4f} g (side -)"
    if motion is None or motion.vertical is None:
        return text
    low, high = (1.0 + lift / response.block.gravity for lift in motion.vertical.extremes)
    if np.array_equal(pair, weight_part):
        return f"{text}, times the weight over that at rest, {low:.4f} to {high:.4f}"
    lowest, highest = ((pair[0] + (factor - 1.0) * weight_part[0]) / STANDARD_GRAVITY for factor in (low, high))
    return f"{text}; from {lowest:.4f} to {highest:.4f} g with the weight{'' if is_single else ', to side +'}"


def _create_event_rows(response: ResponseData) -> list[Row]:
    sequences = {float(row["end"]): row for row in response.sequences}
    perturbed = response.perturbed()
    rows: list[Row] = []
    for event, (low, high) in zip(response.events[:_MAX_EVENTS], perturbed.event_ranges, strict=False):
        if math.isnan(low):
            break
        time, kind = float(event["time"]), str(event["kind"])
        text = format_time(time, low, high)
        note = f", to side {'+' if event['side'] > 0 else '-'}" if kind == "uplift" else ""
        if kind == "rest" and time in sequences:
            note = _describe_proof(_compute_uncertainty(time, low, high), sequences[time])
        rows.append(Row(kind, text, note=note))
    if remaining := len(response.events) - len(rows):
        repeats = f"{len(perturbed.repeats)} {perturbed.scaled_input}"
        note = "" if len(rows) == _MAX_EVENTS else f", not the same in all {repeats}"
        rows.append(Row("...", f"{format_count(remaining, 'more event')}{note}"))
    return rows or [Row("uplift", "none")]


def _describe_proof(uncertainty: float, sequence: np.void) -> str:
    """Describe the proof of a time of rest, with the digits that the record supports."""
    width = sequence["upper"] - sequence["lower"]
    if not width >= 0.0:
        return ", by the scheme, not proven"
    decimals = _count_decimals(uncertainty)
    # The bracket applies to the exact motion, so it would overstate the precision of a rounded time.
    bracket = f", bracket {width:.1e} s wide" if decimals >= _MAX_DECIMALS else ""
    start = f" from {sequence['start']:.{min(decimals, 4)}f} s on" if uncertainty < _MIN_RANGE else ""
    return f", complete chattering proven{start}{bracket}"


def _create_peak_rows(response: ResponseData) -> list[Row]:
    """Return rows of the peak and its time, each with the known digits."""
    perturbed, (name, _, _, unit, limit) = response.perturbed(), response.block.coordinate
    (low, high), digits, balance = perturbed.peak_range, _count_peak_digits(response), response._balance_at_peak
    value = f"{response.peak_rotation:.{digits}g}"
    if shows_range := digits < _MIN_DIGITS and math.isfinite(high):
        value = f"{low:.{_MIN_DIGITS}g} to {high:.{_MIN_DIGITS}g}"
    note = f" at {_format_short_time(response.peak_time, *perturbed.peak_time_range)}"
    if response.overturned:
        note += ", where the block has fallen"
    elif response._reaches_second_stop:
        note += ", at the stop"
    elif limit and math.isfinite(balance):
        ratios = f"{low / balance:.3g} to {high / balance:.3g}" if shows_range else format_ratio(response)
        note += f", {ratios} of the {limit}"
    if not perturbed.is_decided:
        note += f", in {len(perturbed.agreeing_repeats)} of {len(perturbed.repeats)} {perturbed.scaled_input}"
    return [Row(f"peak {name}", value, unit, note)]


def _describe_balance(response: ResponseData) -> str:
    """Return the unstable balance of a restrained block."""
    plus, minus = (f"{value:.5g} rad" if math.isfinite(value) else "none" for value in response.balance)
    if plus != minus and not (isinstance(response.block, RestrainedBlock) and response.block.is_one_sided):
        return f"{plus} (side +), {minus} (side -)"
    return "none: restraints hold it at any rotation" if plus == "none" else plus


def _describe_outcome(response: ResponseData) -> str:
    text = response.perturbed().describe_outcome()
    if response.overturned:
        text += f", at {format_time(response.overturn_time, *response.perturbed().overturn_range)}"
    elif response.unfinished or response.ended_early or response.lost_contact:
        text += f"; {format_outcome(response, '')}"
    if response.rests_by_rounding:
        text += f"; {format_count(response.rests_by_rounding, 'rest')} not proven"
    if response.ambiguous:
        affected = " and ".join(_AMBIGUITIES[name] for name in response.ambiguities)
        text += f"; AMBIGUOUS: one unit in the last place of the input changes {affected}"
    return text


def _describe_stop(response: ResponseData) -> str:
    end = f"{response.duration:.6g} s"
    if not math.isnan(response.tipping_time):
        return f"beyond its balance point since {response.tipping_time:.4f} s and not yet fallen at {end}"
    if response.moves_at_end:
        return f"still {'rocking' if response.block.coordinate.limit_name else 'moving'} at {end}"
    return f"at rest at {end}" if response.moved else f"has not moved by {end}"


def _count_peak_digits(response: ResponseData) -> int:
    """Return the number of known digits of the peak."""
    uncertainty = _compute_uncertainty(response.peak_rotation, *response.perturbed().peak_range)
    value = abs(response.peak_rotation - response.block.stops[0])
    if not math.isfinite(uncertainty):
        return 1
    if not (uncertainty > 0.0 and value != 0.0):
        return _MAX_DIGITS
    return min(max(math.floor(-math.log10(uncertainty / value)), 1), _MAX_DIGITS)


def _compute_uncertainty(value: float, low: float, high: float) -> float:
    """Return the largest distance of a value from the ends of its range."""
    return max(high - value, value - low)


def _count_decimals(uncertainty: float) -> int:
    """Return the decimals of a number with this uncertainty, including the first uncertain one for a range."""
    if not math.isfinite(uncertainty):
        return 0
    if uncertainty <= 0.0:
        return _MAX_DECIMALS
    digits = -math.log10(uncertainty)
    return min(max(math.ceil(digits) if uncertainty >= _MIN_RANGE else math.floor(digits), 0), _MAX_DECIMALS)


def _format_short_time(time: float, low: float, high: float, max_decimals: int = _SHORT_DECIMALS) -> str:
    """Return a time, s, or its range, with at most ``max_decimals`` decimals."""
    uncertainty = _compute_uncertainty(time, low, high)
    decimals = min(_count_decimals(uncertainty), max_decimals)
    is_narrow = 10.0**decimals * uncertainty < 1.0
    return f"{time:.{decimals}f} s" if is_narrow else f"{low:.{decimals}f} to {high:.{decimals}f} s"
