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
from rocking.motion.measures import find_significant_span
from rocking.motion.motion import Motion
from rocking.motion.scaling import Measure

#: Range of plausible peak ground accelerations, g.
_WEAKEST: Final = 1e-3
_STRONGEST: Final = 5.0

#: Peak velocity and sampling step that no record exceeds, m/s and s.
_FASTEST: Final = 5.0
_COARSEST: Final = 0.1

#: Range of peak velocities that every hazard curve partly covers, m/s.
_SPEEDS: Final = (1e-3, _FASTEST)

#: Tolerance of evenly spaced times, in steps, and largest fraction of gaps among the steps.
_UNEVEN: Final = 0.02
_FEW_GAPS: Final = 0.05

#: Levels without a unit that are read as m/s^2 but are probably in g.
_PERHAPS_IN_G: Final = 1.5
_UNITLESS: Final = re.compile(r"[\d.+-]+(?:e[+-]?\d+)?", re.IGNORECASE)

#: Largest plausible diagonal of a block, m.
_LARGEST: Final = 30.0
#: Smallest plausible height of a scanned or modelled body, m.
_LOWEST: Final = 0.02
#: Densities of solids, from foam and cork to osmium, kg/m^3.
_LIGHTEST: Final = 10.0
_HEAVIEST: Final = 23_000.0
#: Largest plausible moment of a restraint per radian, divided by weight times R.
_MOST_HELD: Final = 1e5

_VERTICAL: Final = re.compile(r"(up|down|dn|dwn|ver|vert|vertical|u-?d|z|v|[a-z]{2}z)\b.*", re.IGNORECASE)
_HORIZONTAL: Final = re.compile(
    r"(\d{2,3}|n|e|s|w|ns|ew|n-s|e-w|[ns] ?\d{1,2} ?[ew]|north|east|south|west|h[12]|[a-z]{2}[ne12])( deg.*)?",
    re.IGNORECASE,
)
#: Smallest ratio of the durations of components that start together.
_ALIKE: Final = 0.75


def motion_notes(motion: Motion) -> tuple[str, ...]:
    """Return likely mistakes in a ground motion; empty if there are none."""
    notes = reading_notes(motion)
    direction = _origin(motion).channel
    if _VERTICAL.fullmatch(direction):
        notes += (f"the channel {direction!r} looks vertical, but it is taken for a horizontal motion",)
    return notes + vertical_notes(motion)


def vertical_notes(motion: Motion) -> tuple[str, ...]:
    """Return likely mistakes in the vertical component of a motion; empty if there are none."""
    vertical = motion.vertical
    if vertical is None:
        return ()
    if is_multiple(motion.with_vertical(None), vertical):
        return ("the vertical motion is the horizontal one itself: name its own channel or file",)
    notes = [f"the vertical motion: {sentence}" for sentence in reading_notes(vertical)]
    direction = _origin(vertical).channel
    if _HORIZONTAL.fullmatch(direction) and not _VERTICAL.fullmatch(direction):
        notes.append(f"the channel {direction!r} looks horizontal, but it is taken for the vertical motion")
    for what in ("station", "event"):
        theirs, ours = (getattr(_origin(each), what) for each in (vertical, motion))
        if theirs and ours and _spelled(theirs) != _spelled(ours):
            notes.append(f"the vertical motion is of the {what} {theirs!r}, the horizontal one of {ours!r}")
    return (*notes, *_timing_notes(motion, vertical))


def reading_notes(motion: Motion) -> tuple[str, ...]:
    """Return likely mistakes in the units or the step with which a motion was read."""
    notes = [*_strength_notes(motion)]
    step = motion.dt or motion.duration / len(motion.coefficients)
    if motion.description.family.endswith("record") and step > _COARSEST:
        notes.append(f"the sampling step is {step:.3g} s, too coarse for a record: are the times in seconds?")
    if motion.dt is None and motion.description.family.endswith("record"):
        notes += _gap_notes(motion)
    origin = _origin(motion)
    if origin.heading_units and origin.heading_units != origin.units:
        notes.append(f"the file's heading says {origin.heading_units}, but the numbers are taken for {origin.units}")
    return tuple(notes)


def _gap_notes(motion: Motion) -> list[str]:
    """Return notes on times of a record that skip one or more of its even steps."""
    steps = np.diff(motion.breakpoints)
    usual = float(np.median(steps))
    gaps = np.flatnonzero(np.abs(steps - usual) > _UNEVEN * usual)
    left_out = np.round(steps[gaps] / usual)
    if not 0 < len(gaps) <= _FEW_GAPS * len(steps) or np.any(np.abs(steps[gaps] - left_out * usual) > _UNEVEN * usual):
        return []
    first = float(motion.breakpoints[gaps[0]])
    return [
        f"the times go on by {usual:g} s, but by {steps[gaps[0]]:.3g} s after {first:.6g} s"
        f"{' and elsewhere' if len(gaps) > 1 else ''}: are rows missing? A straight line joins the samples"
    ]


def level_notes(text: str, value: float, name: str) -> tuple[Message, ...]:
    """Return likely mistakes in an acceleration (m/s^2) that was read from a text; empty if there are none."""
    if _UNITLESS.fullmatch(text.strip()) is None or not 0.0 < value <= _PERHAPS_IN_G:
        return ()
    sentence = f"{{}} {text} is taken for {value:g} m/s^2, {value / STANDARD_GRAVITY:.3g} g; write {text}g for {text} g"
    return (Message(sentence, (name,)),)


def hazard_notes(intensity: Floats, measure: Measure) -> tuple[str, ...]:
    """Return likely mistakes in the units of the intensities of a hazard curve; empty if there are none."""
    weakest, strongest = float(intensity[0]), float(intensity[-1])
    least, most = (_WEAKEST * STANDARD_GRAVITY, _STRONGEST * STANDARD_GRAVITY) if measure.units == "m/s^2" else _SPEEDS
    for which, value, is_odd in (("weakest", weakest, weakest > most), ("strongest", strongest, strongest < least)):
        if is_odd:
            return (f"even the {which} motions of the hazard curve have {measure.shown(value)}: are its units right?",)
    return ()


def block_notes(block: Block) -> tuple[str, ...]:
    """Return likely mistakes in the dimensions of a block; empty if there are none."""
    notes = []
    largest = max(2.0 * side.radius for side in block.sides)
    if largest > _LARGEST:
        notes.append(
            f"the diagonal of the block is {largest:.0f} m, more than {_LARGEST:g} m: are its sizes in metres?"
        )
    if block.width is not None and block.height is not None and block.width > block.height:
        wider = f"wider, {block.width:g} m, than it is high, {block.height:g} m"
        notes.append(f"the block is {wider}: are the sizes swapped?")
    slender, stocky = sorted(block.sides, key=lambda side: side.alpha)
    if slender.alpha < stocky.alpha and slender.p <= stocky.p:
        notes.append(
            f"the more slender side has no larger p, {slender.p:g} rad/s, than the other, so that the mass lies as far "
            "from its centre as the pivots do: are the sides of p swapped, or its digits too few?"
        )
    return tuple(notes)


def height_notes(height: float) -> tuple[str, ...]:
    """Return likely mistakes in the height, m, of a body from a mesh; empty if there are none."""
    return (
        () if _LOWEST <= height <= _LARGEST else (f"the body is {height:.4g} m high: are its coordinates in metres?",)
    )


def density_notes(densities: Sequence[float | None]) -> tuple[str, ...]:
    """Return likely mistakes in densities, kg/m^3, of parts of a body; empty if there are none."""
    unlikely = [each for each in densities if each is not None and not _LIGHTEST <= each <= _HEAVIEST]
    return tuple(
        f"a density is {each:g} kg/m^3, and no solid is so light or so heavy: is it in kg/m^3?" for each in unlikely[:1]
    )


def restraint_notes(body: RestrainedBlock) -> tuple[str, ...]:
    """Return likely mistakes in the restraints of a block; empty if there are none."""
    strongest = max(max(*map(abs, terms[:4]), terms.stiffness * terms.opening) for terms in body._terms)
    if strongest <= _MOST_HELD:
        return ()
    return (f"what a restraint does is {strongest:.2g} times the weight or more: are forces in N, and masses in kg?",)


def _strength_notes(motion: Motion) -> Iterator[str]:
    """Yield notes on accelerations and velocities of another order of magnitude than in ground motions."""
    pga = motion.pga / STANDARD_GRAVITY
    if pga == 0.0:
        yield "the acceleration is zero throughout"
    elif pga > _STRONGEST:
        yield f"the peak acceleration is {pga:.3g} g, more than any ground motion has: are the units right?"
    elif pga < _WEAKEST:
        yield f"the peak acceleration is {pga:.3g} g, which moves no block: are the units right?"
    elif motion.pgv > _FASTEST:
        yield (
            f"the peak velocity is {motion.pgv:.3g} m/s, too much for a ground motion: are units and step right, or is "
            "an offset left?"
        )


def _timing_notes(motion: Motion, vertical: Motion) -> Iterator[str]:
    """Yield notes on components that seem to start at different times."""
    if later := compute_start_delay(motion.description, vertical.description, motion.dt):
        yield (
            f"by its file the vertical motion begins {abs(later):.4g} s {'after' if later > 0.0 else 'before'} the "
            "horizontal one, but both are taken to start together: cut what comes first"
        )
        return
    (start, end), (first, last) = (find_significant_span(each) for each in (motion, vertical))
    if last < start or first > end:
        yield (
            f"the horizontal motion is strong from {start:.4g} s to {end:.4g} s, the vertical one from {first:.4g} s "
            f"to {last:.4g} s: do both start at the same time?"
        )
    elif min(motion.duration, vertical.duration) < _ALIKE * max(motion.duration, vertical.duration):
        yield (
            f"the horizontal motion lasts {motion.duration:.4g} s, the vertical one {vertical.duration:.4g} s: do both "
            "start at the same time?"
        )


def is_multiple(motion: Motion, other: Motion, *, reversed_too: bool = True) -> bool:
    """Whether two motions differ only by a factor, within rounding error; with `reversed_too` also a negative one."""
    parts = [[part for part in (one, one.vertical) if part is not None] for one in (motion, other)]
    if [part.coefficients.shape for part in parts[0]] != [part.coefficients.shape for part in parts[1]]:
        return False
    times, others_times = (np.concatenate([part.breakpoints for part in each]) for each in parts)
    values, others = (np.concatenate([part.coefficients.ravel() for part in each]) for each in parts)
    largest, others_largest = np.abs(values).max(), np.abs(others).max()
    if not largest > 0.0 < others_largest or not np.allclose(times, others_times, rtol=1e-9, atol=0.0):
        return False
    signs = np.where(np.arange(values.size) < motion.coefficients.size, -1.0, 1.0)
    apart = [others / others_largest - way * values / largest for way in ([1.0, signs] if reversed_too else [1.0])]
    return any(bool(np.abs(each).max() <= 1e-9) for each in apart)


def _origin(motion: Motion) -> Origin:
    return motion.description.origin or Origin()


def _spelled(text: str) -> str:
    return re.sub(r"\W+", " ", text).strip().casefold()
