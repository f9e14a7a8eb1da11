"""Notes on input values that are possible but probably mistaken, which raise no error."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from typing import Final

import numpy as np

from rocking.block import Block, RestrainedBlock
from rocking.core.arrays import Floats
from rocking.core.constants import STANDARD_GRAVITY
from rocking.errors import Message
from rocking.motion.description import Origin, compute_start_delay
from rocking.motion.measures import compute_significant_span
from rocking.motion.motion import Motion
from rocking.motion.scaling import Measure

#: Range of plausible peak ground accelerations, g.
_MIN_PGA: Final = 1e-3
_MAX_PGA: Final = 5.0

#: Peak velocity and sampling step that no record exceeds, m/s and s.
_MAX_PGV: Final = 5.0
_MAX_STEP: Final = 0.1

#: Range of peak velocities that every hazard curve partly covers, m/s.
_PGV_RANGE: Final = (1e-3, _MAX_PGV)

#: Tolerance of evenly spaced times, in steps, and largest fraction of gaps among the steps.
_TIMING_TOLERANCE: Final = 0.02
_MAX_GAPS: Final = 0.05

#: Levels without a unit that are read as m/s^2 but are probably in g.
_MAX_AMBIGUOUS_LEVEL: Final = 1.5
_PURE_NUMBER: Final = re.compile(r"[\d.+-]+(?:e[+-]?\d+)?", re.IGNORECASE)

#: Largest plausible diagonal of a block, m.
_MAX_LENGTH: Final = 30.0
#: Smallest plausible height of a scanned or modelled body, m.
_MIN_HEIGHT: Final = 0.02
#: Densities of solids, from foam and cork to osmium, kg/m^3.
_MIN_DENSITY: Final = 10.0
_MAX_DENSITY: Final = 23_000.0
#: Largest plausible moment of a restraint per radian, divided by weight times R.
_MAX_MOMENT: Final = 1e5

_HORIZONTAL_CHANNEL: Final = re.compile(
    r"(\d{2,3}|n|e|s|w|ns|ew|n-s|e-w|[ns] ?\d{1,2} ?[ew]|north|east|south|west|h[12]|[a-z]{2}[ne12])( deg.*)?",
    re.IGNORECASE,
)
#: Smallest ratio of the durations of components that start together.
_MIN_DURATION_RATIO: Final = 0.75


def list_motion_notes(motion: Motion) -> tuple[str, ...]:
    """Return likely mistakes in a ground motion; empty if there are none.

    See Also
    --------
    rocking.inputs.notes.list_block_notes : Return likely mistakes in a block.
    rocking.read : Read a motion from a record file.

    Examples
    --------
    >>> import rocking
    >>> from rocking.inputs.notes import list_motion_notes
    >>> motion = rocking.Motion.from_samples([0.0, 80.0, -60.0, 0.0], dt=0.01)
    >>> list_motion_notes(motion)
    ('the peak acceleration is 8.16 g, more than any ground motion has: are the units right?',)
    """
    notes, direction = list_reading_notes(motion), _find_origin(motion).channel
    if _find_origin(motion).is_vertical:
        notes += (f"the channel {direction!r} looks vertical, but it is taken for a horizontal motion",)
    if "borehole" in direction:
        notes += (f"the channel {direction!r} is below the ground surface, where motions are weaker",)
    return notes + list_vertical_notes(motion)


def list_vertical_notes(motion: Motion) -> tuple[str, ...]:
    """Return likely mistakes in the vertical component of a motion; empty if there are none."""
    vertical = motion.vertical
    if vertical is None:
        return ()
    if is_multiple(motion.with_vertical(None), vertical):
        return ("the vertical motion is the horizontal one itself: name its own channel or file",)
    notes = [f"the vertical motion: {sentence}" for sentence in list_reading_notes(vertical)]
    direction = _find_origin(vertical).channel
    if _HORIZONTAL_CHANNEL.fullmatch(direction) and not _find_origin(vertical).is_vertical:
        notes.append(f"the channel {direction!r} looks horizontal, but it is taken for the vertical motion")
    for attribute in ("station", "event"):
        upward, level = (getattr(_find_origin(component), attribute) for component in (vertical, motion))
        if upward and level and _normalise(upward) != _normalise(level):
            notes.append(f"the vertical motion is of the {attribute} {upward!r}, the horizontal one of {level!r}")
    return (*notes, *_list_timing_notes(motion, vertical))


def list_reading_notes(motion: Motion) -> tuple[str, ...]:
    """Return likely mistakes in the units or the step with which a motion was read."""
    notes = [*_list_strength_notes(motion)]
    step = motion.dt or motion.duration / len(motion.coefficients)
    if motion.description.family.endswith("record") and step > _MAX_STEP:
        notes.append(f"the sampling step is {step:.3g} s, too coarse for a record: are the times in seconds?")
    if motion.dt is None and motion.description.family.endswith("record"):
        notes += _list_gap_notes(motion)
    origin = _find_origin(motion)
    if origin.heading_units and origin.heading_units != origin.units:
        notes.append(f"the file's heading says {origin.heading_units}, but the numbers are taken for {origin.units}")
    return tuple(notes)


def _list_gap_notes(motion: Motion) -> list[str]:
    """Return notes on times of a record that skip one or more of its even steps."""
    steps = np.diff(motion.breakpoints)
    step = float(np.median(steps))
    gaps = np.flatnonzero(np.abs(steps - step) > _TIMING_TOLERANCE * step)
    multiples = np.round(steps[gaps] / step)
    are_multiples = np.all(np.abs(steps[gaps] - multiples * step) <= _TIMING_TOLERANCE * step)
    if not 0 < len(gaps) <= _MAX_GAPS * len(steps) or not are_multiples:
        return []
    others = " and elsewhere" if len(gaps) > 1 else ""
    gap_text = f"by {steps[gaps[0]]:.3g} s after {motion.breakpoints[gaps[0]]:.6g} s{others}"
    return [f"the times go on by {step:g} s, but {gap_text}: are rows missing? A straight line joins the samples"]


def list_level_notes(text: str, value: float, name: str) -> tuple[Message, ...]:
    """Return likely mistakes in an acceleration (m/s^2) that was read from a text; empty if there are none."""
    if _PURE_NUMBER.fullmatch(text.strip()) is None or not 0.0 < value <= _MAX_AMBIGUOUS_LEVEL:
        return ()
    sentence = f"{{}} {text} is taken for {value:g} m/s^2, {value / STANDARD_GRAVITY:.3g} g; write {text}g for {text} g"
    return (Message(sentence, (name,)),)


def list_hazard_notes(intensity: Floats, measure: Measure) -> tuple[str, ...]:
    """Return likely mistakes in the units of the intensities of a hazard curve; empty if there are none."""
    weakest, strongest = float(intensity[0]), float(intensity[-1])
    is_acceleration = measure.units == "m/s^2"
    lowest, highest = np.array((_MIN_PGA, _MAX_PGA)) * STANDARD_GRAVITY if is_acceleration else _PGV_RANGE
    if lowest <= strongest and weakest <= highest:
        return ()
    kind, value = ("weakest", weakest) if weakest > highest else ("strongest", strongest)
    return (f"even the {kind} motions of the hazard curve have {measure.format_value(value)}: are its units right?",)


def list_block_notes(block: Block) -> tuple[str, ...]:
    """Return likely mistakes in the dimensions of a block; empty if there are none.

    See Also
    --------
    rocking.inputs.notes.list_motion_notes : Return likely mistakes in a ground motion.
    rocking.Block : Create a block.

    Examples
    --------
    >>> import rocking
    >>> from rocking.inputs.notes import list_block_notes
    >>> list_block_notes(rocking.Block(width=2.0, height=1.0, restitution=0.9))
    ('the block is wider, 2 m, than it is high, 1 m: are the sizes swapped?',)
    """
    notes = []
    diagonal = max(2.0 * side.radius for side in block.sides)
    if diagonal > _MAX_LENGTH:
        length_text = f"{diagonal:.0f} m, more than {_MAX_LENGTH:g} m"
        notes.append(f"the diagonal of the block is {length_text}: are its sizes in metres?")
    if block.width is not None and block.height is not None and block.width > block.height:
        size_text = f"wider, {block.width:g} m, than it is high, {block.height:g} m"
        notes.append(f"the block is {size_text}: are the sizes swapped?")
    slender, stocky = sorted(block.sides, key=lambda side: side.alpha)
    if slender.alpha < stocky.alpha and slender.p <= stocky.p:
        notes.append(
            f"the more slender side has no larger p, {slender.p:g} rad/s, than the other, so that the mass lies as far "
            "from its centre as the pivots do: are the sides of p swapped, or its digits too few?"
        )
    return tuple(notes)


def list_height_notes(height: float) -> tuple[str, ...]:
    """Return likely mistakes in the height, m, of a body from a mesh; empty if there are none."""
    sentence = f"the body is {height:.4g} m high: are its coordinates in metres?"
    return () if _MIN_HEIGHT <= height <= _MAX_LENGTH else (sentence,)


def list_density_notes(densities: Sequence[float | None]) -> tuple[str, ...]:
    """Return likely mistakes in densities, kg/m^3, of parts of a body; empty if there are none."""
    for density in densities:
        if density is not None and not _MIN_DENSITY <= density <= _MAX_DENSITY:
            return (f"a density is {density:g} kg/m^3, and no solid is so light or so heavy: is it in kg/m^3?",)
    return ()


def list_restraint_notes(body: RestrainedBlock) -> tuple[str, ...]:
    """Return likely mistakes in the restraints of a block; empty if there are none."""
    strongest = max(max(*map(abs, terms[:4]), terms.tendon_stiffness * terms.lever_arm) for terms in body._terms)
    if strongest <= _MAX_MOMENT:
        return ()
    return (f"what a restraint does is {strongest:.2g} times the weight or more: are forces in N, and masses in kg?",)


def _list_strength_notes(motion: Motion) -> Iterator[str]:
    """Yield notes on accelerations and velocities of another order of magnitude than in ground motions."""
    pga = motion.pga / STANDARD_GRAVITY
    if pga == 0.0:
        yield "the acceleration is zero throughout"
    elif pga > _MAX_PGA:
        yield f"the peak acceleration is {pga:.3g} g, more than any ground motion has: are the units right?"
    elif pga < _MIN_PGA:
        yield f"the peak acceleration is {pga:.3g} g, which moves no block: are the units right?"
    elif motion.pgv > _MAX_PGV:
        yield (
            f"the peak velocity is {motion.pgv:.3g} m/s, too much for a ground motion: are units and step right, or is "
            "an offset left?"
        )


def _list_timing_notes(motion: Motion, vertical: Motion) -> Iterator[str]:
    """Yield notes on components that seem to start at different times."""
    if later := compute_start_delay(motion.description, vertical.description, motion.dt):
        yield (
            f"by its file the vertical motion begins {abs(later):.4g} s {'after' if later > 0.0 else 'before'} the "
            "horizontal one, but both are taken to start together: cut what comes first"
        )
        return
    (start, end), (first, last) = (compute_significant_span(component) for component in (motion, vertical))
    if last < start or first > end:
        yield (
            f"the horizontal motion is strong from {start:.4g} s to {end:.4g} s, the vertical one from {first:.4g} s "
            f"to {last:.4g} s: do both start at the same time?"
        )
    elif min(motion.duration, vertical.duration) < _MIN_DURATION_RATIO * max(motion.duration, vertical.duration):
        yield (
            f"the horizontal motion lasts {motion.duration:.4g} s, the vertical one {vertical.duration:.4g} s: do both "
            "start at the same time?"
        )


def is_multiple(motion: Motion, other: Motion, *, include_reversed: bool = True) -> bool:
    """Whether two motions differ only by a factor, within rounding error, by choice also a negative one."""
    parts = [[part for part in (component, component.vertical) if part is not None] for component in (motion, other)]
    if [part.coefficients.shape for part in parts[0]] != [part.coefficients.shape for part in parts[1]]:
        return False
    times, other_times = (np.concatenate([part.breakpoints for part in group]) for group in parts)
    values, others = (np.concatenate([part.coefficients.ravel() for part in group]) for group in parts)
    peak, other_peak = np.abs(values).max(), np.abs(others).max()
    if not peak > 0.0 < other_peak or not np.allclose(times, other_times, rtol=1e-9, atol=0.0):
        return False
    signs = np.where(np.arange(values.size) < motion.coefficients.size, -1.0, 1.0)
    factors = [1.0, signs] if include_reversed else [1.0]
    differences = [others / other_peak - factor * values / peak for factor in factors]
    return any(bool(np.abs(difference).max() <= 1e-9) for difference in differences)


def _find_origin(motion: Motion) -> Origin:
    return motion.description.origin or Origin()


def _normalise(text: str) -> str:
    return re.sub(r"\W+", " ", text).strip().casefold()
