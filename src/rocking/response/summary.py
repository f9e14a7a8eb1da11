"""Text summaries of a response, with the digits that are known."""

from __future__ import annotations

import math
from typing import Final

import numpy as np

from rocking.block import Block, RestrainedBlock
from rocking.block.sides import in_line
from rocking.core.constants import STANDARD_GRAVITY
from rocking.core.result import Row
from rocking.core.tables import format_count
from rocking.engine.problem import thresholds_of
from rocking.response.perturbed import percent, steps_within
from rocking.response.simulated import Simulated

#: Largest numbers of decimals of a time and digits of a peak, and digits of a range of peaks.
_MOST_DECIMALS: Final = 9
_MOST_DIGITS: Final = 6
_FEWEST_DIGITS: Final = 3

#: Decimals of a time in a table, and next to other values in a summary.
_BRIEF: Final = 2
_SHORT: Final = 4

#: Smallest range of a time, s, that is reported.
_SHOWN: Final = 1e-3

#: Largest number of events in a summary.
_LISTED: Final = 12

#: Unknown results of an ambiguous response.
_AFFECTED: Final = {
    "peak": "the peak rotation",
    "events": "times of events or impacts",
    "touch": "whether the body lifts off, touches the ground or falls from its balance",
}


def summary_rows(response: Simulated, friction: float | None, precision: float) -> list[Row]:
    """Return the rows of a summary, including the check of a coefficient of friction if given."""
    body = response.block
    sliding = math.nan if friction is None else response.sliding_time(friction)
    rows = [
        Row("block" if isinstance(body, Block) else "body", body.description),
        Row("parameters", in_line(body.sides)),
        *([Row("balance", _balance_text(response))] if isinstance(body, RestrainedBlock) else []),
        Row("motion", _motion_text(response)),
        Row("uplift above", _thresholds_text(response)),
        *_event_rows(response),
        Row("impacts resolved", f"{len(response.impacts)}"),
        *_peak_rows(response),
        *([Row(f"residual {body.coordinate.name}", _residual_text(response))] if response.leans else []),
    ]
    for row in response.tendons:
        stays = f", {1e3 * row['plastic_elongation']:.4g} mm of it for good" if row["plastic_elongation"] else ""
        text = f"longer by {1e3 * row['elongation']:.4g} mm at most{stays}"
        rows.append(Row("tendon", text, note=f", force {1e-3 * row['force']:.4g} kN at most"))
    if isinstance(body, RestrainedBlock) and body.contact is None:
        rows.append(Row("friction, lift-off", "not judged: the forces of the ground are not known"))
    if body.contact is not None:
        tips = "" if math.isnan(response.tipping_time) else f", until it tips at {tipping_text(response)}"
        rows += [
            Row("friction needed", f"{response.required_friction:.4f}", note=tips),
            Row("least normal force", f"{response.minimum_normal_force:.4f}", "of the weight", tips),
        ]
        if friction is not None:
            slides = f"is not enough: the block slides, first at {sliding:.4f} s; what follows is not this response"
            enough = "is enough: the block does not slide"
            rows.append(Row(f"friction {friction:g}", enough if math.isnan(sliding) else slides))
        if not math.isnan(response.lift_off_time):
            rows.append(Row("base lifts off", f"at {response.lift_off_time:.4f} s; what follows is not this response"))
    near = response.perturbed()
    if (
        np.max(np.nan_to_num(near.event_spreads, nan=math.inf), initial=0.0) >= _SHOWN
        or _peak_digits(response) < _FEWEST_DIGITS
    ):
        rows.append(Row("ranges", f"those of the {near.sample}; other factors can lead beyond them"))
    without_sliding = "" if math.isnan(sliding) else " (as if it did not slide)"
    return [
        *rows,
        Row("outcome", _outcome(response), note=without_sliding),
        Row("", response.perturbed(*steps_within(precision)).share()),
    ]


def line(response: Simulated) -> str:
    """Return the response in one line."""
    motion, limit = response.motion, response.block.coordinate.limit
    peak = ""
    if limit and not response.overturned and math.isfinite(response._balance_at_peak):
        peak = f", peak {ratio_text(response)} of the {limit}"
    return (
        f"{response.block.description} under {'no motion' if motion is None else motion.label}: "
        f"{in_words(response, f'{response.overturn_time:.4f} s')}{peak}; "
        f"{format_count(len(response.events), 'event')}, {format_count(len(response.impacts), 'impact')} resolved, "
        f"{response.duration:.5g} s"
    )


def in_words(response: Simulated, overturn_time: str) -> str:
    """Return the outcome for the summary. The time of overturning is passed as text."""
    if response.overturned:
        return f"overturns at {overturn_time}"
    if response.unfinished:
        return f"UNFINISHED: given up at {response.duration:.4f} s, after too many steps"
    if response.stopped:
        motion = response.motion
        goes_on = motion is not None and response.duration < motion.end
        to_come = f"; the motion goes on to {motion.end:.6g} s" if motion is not None and goes_on else ""
        return f"{_when_stopped(response)}, where the simulation was stopped{to_come}"
    if response.leans and response.block.coordinate.limit:
        return f"does not overturn: it stays leaning, at {_residual_text(response)}"
    if not response.moved:
        return "does not move"
    return "rocks and does not overturn" if response.block.coordinate.limit else "moves, and comes to rest"


def in_brief(response: Simulated, precision: float) -> str:
    """Return the outcome for a row of a table."""
    near, further = response.perturbed(), response.perturbed(*steps_within(precision))
    if not near.is_decided and near.overturned.any():
        shares = [int(each.overturned.sum()) for each in (near, further)]
        text = "undecided: overturns"
    else:
        shares = [len(each.alike) for each in (near, further)]
        text = near.outcome if near.is_decided else f"undecided: {near.outcome}"
    if response.overturned and near.is_decided:
        text += f" at {_short_text(response.overturn_time, *near.overturn_range, most=_BRIEF)}"
    elif response.leans:
        text += f" at {_residual_text(response)}"
    elif response.stopped:
        text = _when_stopped(response) if near.is_decided else text
    parts = [
        f"{share} of {len(each.repeats)} ({percent(each.within)})"
        for share, each in zip(shares, (near, further), strict=True)
    ]
    return f"{text} in {', '.join(parts)}{', AMBIGUOUS' if response.ambiguous else ''}"


def _residual_text(response: Simulated) -> str:
    """Return the residual rotation, which depends on the peak if a tendon has yielded."""
    return f"{response.residual_rotation:.{_peak_digits(response)}g} {response.block.coordinate.unit}"


def ratio_text(response: Simulated) -> str:
    """Return the normalised peak rotation with the known digits."""
    return f"{response.peak_over_slenderness:.{min(_peak_digits(response), 4)}g}"


def known_ratio(response: Simulated) -> float:
    """Return the normalised peak rotation, rounded if fewer than four digits are known."""
    return response.peak_over_slenderness if _peak_digits(response) >= _SHORT else float(ratio_text(response))


def time_text(time: float, low: float, high: float) -> str:
    """Return a time, s, with the digits common to its range, or its range if wide."""
    unknown = _unknown(time, low, high)
    decimals = _decimals(unknown)
    if unknown < _SHOWN:
        return f"{time:.{decimals}f} s"
    return f"{low:.{decimals}f} to {high:.{decimals}f} s"


def tipping_text(response: Simulated) -> str:
    """Return the tipping time with the known digits, which equal the ones of the overturning time."""
    unknown = 0.0
    if response.overturned:
        unknown = _unknown(response.overturn_time, *response.perturbed().overturn_range)
    about = "" if unknown < _SHOWN else "about "
    return f"{about}{response.tipping_time:.{min(_decimals(unknown), _SHORT)}f} s"


def _motion_text(response: Simulated) -> str:
    """Describe the ground motion. In all texts g is standard gravity."""
    motion = response.motion
    if motion is None:
        return "none: free rocking"
    parts = [f"{motion.name}, {motion.duration:.2f} s, peak {motion.pga / STANDARD_GRAVITY:.4f} g", *motion.history]
    if motion.vertical is not None:
        parts.append(f"vertical {motion.vertical.name}, peak {motion.vertical.pga / STANDARD_GRAVITY:.4f} g")
    return "; ".join(parts)


def _thresholds_text(response: Simulated) -> str:
    """Return the uplift thresholds, which vary with the weight under vertical motion."""
    motion = response.motion
    (pair,), (own,) = thresholds_of(response.block.alone(), response.model)
    plus, minus = (pair / STANDARD_GRAVITY).tolist()
    one = plus == minus or math.isinf(minus)
    text = f"{plus:.4f} g" if one else f"{plus:.4f} g (side +), {minus:.4f} g (side -)"
    if motion is None or motion.vertical is None:
        return text
    low, high = (1.0 + lift / response.block.gravity for lift in motion.vertical.extremes)
    if np.array_equal(pair, own):
        return f"{text}, times the weight over that at rest, {low:.4f} to {high:.4f}"
    least, most = ((pair[0] + (factor - 1.0) * own[0]) / STANDARD_GRAVITY for factor in (low, high))
    return f"{text}; from {least:.4f} to {most:.4f} g with the weight{'' if one else ', to side +'}"


def _event_rows(response: Simulated) -> list[Row]:
    sequences = {float(row["end"]): row for row in response.sequences}
    near = response.perturbed()
    rows: list[Row] = []
    for event, (low, high) in zip(response.events[:_LISTED], near.event_ranges, strict=False):
        if math.isnan(low):
            break
        time, kind = float(event["time"]), str(event["kind"])
        text = time_text(time, low, high)
        if kind == "rest" and time in sequences:
            rows.append(Row(kind, text, note=_rest_note(_unknown(time, low, high), sequences[time])))
        else:
            side = f", to side {'+' if event['side'] > 0 else '-'}" if kind == "uplift" else ""
            rows.append(Row(kind, text, note=side))
    if left := len(response.events) - len(rows):
        differ = "" if len(rows) == _LISTED else f", not the same in all {len(near.repeats)} {near.scaled}"
        rows.append(Row("...", f"{format_count(left, 'more event')}{differ}"))
    return rows or [Row("uplift", "none")]


def _rest_note(unknown: float, sequence: np.void) -> str:
    """Describe the proof of a time of rest, with the digits that the record supports."""
    width = sequence["upper"] - sequence["lower"]
    if not width >= 0.0:
        return ", by the scheme, not proven"
    decimals = _decimals(unknown)
    # The bracket applies to the exact motion, so it would overstate the precision of a rounded time.
    bracket = f", bracket {width:.1e} s wide" if decimals >= _MOST_DECIMALS else ""
    start = f" from {sequence['start']:.{min(decimals, 4)}f} s on" if unknown < _SHOWN else ""
    return f", complete chattering proven{start}{bracket}"


def _peak_rows(response: Simulated) -> list[Row]:
    """Return rows of the peak and its time, each with the known digits."""
    near, (name, _, _, unit, limit) = response.perturbed(), response.block.coordinate
    (low, high), digits, balance = near.peak_range, _peak_digits(response), response._balance_at_peak
    value = f"{response.peak_rotation:.{digits}g}"
    if spread := digits < _FEWEST_DIGITS and math.isfinite(high):
        value = f"{low:.{_FEWEST_DIGITS}g} to {high:.{_FEWEST_DIGITS}g}"
    note = f" at {_short_text(response.peak_time, *near.peak_time_range)}"
    if response.overturned:
        note += ", where the block has fallen"
    elif response._reaches_second_stop:
        note += ", at the stop"
    elif limit and math.isfinite(balance):
        ratios = f"{low / balance:.3g} to {high / balance:.3g}" if spread else ratio_text(response)
        note += f", {ratios} of the {limit}"
    if not near.is_decided:
        note += f", in {len(near.alike)} of {len(near.repeats)} {near.scaled}"
    return [Row(f"peak {name}", value, unit, note)]


def _balance_text(response: Simulated) -> str:
    """Return the unstable balance of a restrained block."""
    plus, minus = (f"{value:.5g} rad" if math.isfinite(value) else "none" for value in response.balance)
    if plus != minus and not (isinstance(response.block, RestrainedBlock) and response.block.is_one_sided):
        return f"{plus} (side +), {minus} (side -)"
    return "none: restraints hold it at any rotation" if plus == "none" else plus


def _outcome(response: Simulated) -> str:
    text = response.perturbed().sentence()
    if response.overturned:
        text += f", at {time_text(response.overturn_time, *response.perturbed().overturn_range)}"
    elif response.unfinished or response.stopped:
        text += f"; {in_words(response, '')}"
    if response.rests_by_rounding:
        text += f"; {format_count(response.rests_by_rounding, 'rest')} not proven"
    if response.ambiguous:
        affected = " and ".join(_AFFECTED[name] for name in response.ambiguities)
        text += f"; AMBIGUOUS: one unit in the last place of the input changes {affected}"
    return text


def _when_stopped(response: Simulated) -> str:
    end = f"{response.duration:.6g} s"
    if not math.isnan(response.tipping_time):
        return f"beyond its balance point since {response.tipping_time:.4f} s and not yet fallen at {end}"
    if response.moves_at_end:
        return f"still {'rocking' if response.block.coordinate.limit else 'moving'} at {end}"
    return f"at rest at {end}" if response.moved else f"has not moved by {end}"


def _peak_digits(response: Simulated) -> int:
    """Return the number of known digits of the peak."""
    unknown = _unknown(response.peak_rotation, *response.perturbed().peak_range)
    value = abs(response.peak_rotation - response.block.stops[0])
    if not math.isfinite(unknown):
        return 1
    if not (unknown > 0.0 and value != 0.0):
        return _MOST_DIGITS
    return min(max(math.floor(-math.log10(unknown / value)), 1), _MOST_DIGITS)


def _unknown(value: float, low: float, high: float) -> float:
    """Return the largest distance of a value from the ends of its range."""
    return max(high - value, value - low)


def _decimals(unknown: float) -> int:
    """Return the decimals of a number with this uncertainty, including the first uncertain one for a range."""
    if not math.isfinite(unknown):
        return 0
    if unknown <= 0.0:
        return _MOST_DECIMALS
    known = -math.log10(unknown)
    return min(max(math.ceil(known) if unknown >= _SHOWN else math.floor(known), 0), _MOST_DECIMALS)


def _short_text(time: float, low: float, high: float, most: int = _SHORT) -> str:
    """Return a time, s, or its range, with at most ``most`` decimals."""
    unknown = _unknown(time, low, high)
    decimals = min(_decimals(unknown), most)
    if 10.0**decimals * unknown < 1.0:
        return f"{time:.{decimals}f} s"
    return f"{low:.{decimals}f} to {high:.{decimals}f} s"
