"""What is possible but looks like a mistake: sentences for the one who gave the numbers. Nothing is refused."""

from __future__ import annotations

import re
from collections.abc import Iterator
from typing import Final

from rocking.block import Block
from rocking.constants import STANDARD_GRAVITY
from rocking.motion.motion import Motion

#: Peak accelerations of ground motions that were ever of interest, g.
_WEAKEST: Final = 1e-3
_STRONGEST: Final = 5.0

#: Peak velocities and sampling steps beyond those of any record, m/s and s.
_FASTEST: Final = 5.0
_COARSEST: Final = 0.1

#: Levels without a unit that look as if they were in g; they are taken for m/s^2.
_PERHAPS_IN_G: Final = 1.5
_UNITLESS: Final = re.compile(r"[\d.+-]+(?:e[+-]?\d+)?", re.IGNORECASE)

#: Larger blocks are no blocks, m.
_LARGEST: Final = 30.0

_CHANNEL: Final = re.compile(r"channel \d+ ['\"]([^'\"]*)['\"]|direction ([\w-]+)")
_VERTICAL: Final = re.compile(r"(up|down|dn|dwn|ver|vert|vertical|u-?d|z|v|[a-z]{2}z)\b.*", re.IGNORECASE)
_HEADING_UNITS: Final = re.compile(r"heading units (\S+?),")
_UNITS: Final = re.compile(r"(?<!heading )units ([^\s,]+)")


def motion_notes(motion: Motion) -> tuple[str, ...]:
    """Return what looks like a mistake in a motion that shakes a block horizontally; empty if nothing does.

    Parameters
    ----------
    motion : Motion
        A record, for what its file says; or any motion, for its peak.

    Returns
    -------
    tuple of str
        Sentences.

    Examples
    --------
    >>> from rocking import Motion
    >>> motion_notes(Motion.from_samples([0.0, 300.0, -100.0, 0.0], 0.01))
    ('the peak acceleration is 30.6 g, more than any ground motion has: are the units right?',)
    """
    notes = reading_notes(motion)
    direction = _direction(motion)
    if _VERTICAL.fullmatch(direction):
        notes += (f"the channel {direction!r} looks vertical, but it is taken for a horizontal motion",)
    return notes


def reading_notes(motion: Motion) -> tuple[str, ...]:
    """Return what looks like a mistake in the units or the step that a motion was read with; empty if nothing does.

    Examples
    --------
    >>> from rocking import Motion
    >>> reading_notes(Motion.from_samples([0.0, 1.0, -2.0, 0.0], 20.0))
    ('the peak velocity is 20 m/s, too much for a ground motion: are units and step right, or is an offset left?',)
    """
    notes = [*_strength_notes(motion)]
    step = motion.step or motion.duration / len(motion.coefficients)
    if motion.description.family.endswith("record") and step > _COARSEST:
        notes.append(f"the sampling step is {step:.3g} s, too coarse for a record: are the times in seconds?")
    text = motion.description.text
    heading, taken = _HEADING_UNITS.search(text), _UNITS.search(text)
    if heading is not None and taken is not None and heading[1] != taken[1]:
        notes.append(f"the file's heading says {heading[1]}, but the numbers are taken for {taken[1]}")
    return tuple(notes)


def level_notes(text: str, value: float, option: str) -> tuple[str, ...]:
    """Return what looks like a mistake in an acceleration that a motion is scaled to; empty if nothing does.

    Parameters
    ----------
    text : str
        As it was written.
    value : float
        What it was taken for, m/s^2.
    option : str
        What it was written for.

    Examples
    --------
    >>> level_notes("0.4", 0.4, "--pga"), level_notes("0.4g", 3.92, "--pga")
    (('--pga 0.4 is taken for 0.4 m/s^2, 0.0408 g; write 0.4g for 0.4 g',), ())
    """
    if _UNITLESS.fullmatch(text.strip()) is None or not 0.0 < value <= _PERHAPS_IN_G:
        return ()
    return (
        f"{option} {text} is taken for {value:g} m/s^2, {value / STANDARD_GRAVITY:.3g} g; write {text}g for {text} g",
    )


def block_notes(block: Block) -> tuple[str, ...]:
    """Return what looks like a mistake in the sizes of a block; empty if nothing does.

    Examples
    --------
    >>> from rocking import Block
    >>> block_notes(Block(width=2.0, height=0.5, restitution=0.5))
    ('the block is wider, 2 m, than it is high, 0.5 m: are the sizes swapped?',)
    """
    notes = []
    largest = max(2.0 * side.radius for side in block.sides)
    if largest > _LARGEST:
        notes.append(
            f"the diagonal of the block is {largest:.0f} m, more than {_LARGEST:g} m: are its sizes in metres?"
        )
    if block.half_width is not None and block.half_height is not None and block.half_width > block.half_height:
        width, height = 2.0 * block.half_width, 2.0 * block.half_height
        notes.append(f"the block is wider, {width:g} m, than it is high, {height:g} m: are the sizes swapped?")
    return tuple(notes)


def _strength_notes(motion: Motion) -> Iterator[str]:
    """Sentences on accelerations and velocities of another order than those of ground motions."""
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


def _direction(motion: Motion) -> str:
    """Return the name of a record's channel or its direction, or an empty text."""
    found = _CHANNEL.search(motion.description.text)
    return (found[1] or found[2] or "").strip() if found else ""
