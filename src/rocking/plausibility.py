"""What is possible but looks like a mistake: sentences for the one who gave the numbers. Nothing is refused."""

from __future__ import annotations

import re
from typing import Final

from rocking.block import Block
from rocking.constants import STANDARD_GRAVITY
from rocking.motion.motion import Motion

#: Peak accelerations of ground motions that were ever of interest, g.
_WEAKEST: Final = 1e-3
_STRONGEST: Final = 5.0

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
    notes = []
    pga = motion.pga / STANDARD_GRAVITY
    if pga > _STRONGEST:
        notes.append(f"the peak acceleration is {pga:.3g} g, more than any ground motion has: are the units right?")
    elif 0.0 < pga < _WEAKEST:
        notes.append(f"the peak acceleration is {pga:.3g} g, which moves no block: are the units right?")
    direction = _direction(motion)
    if _VERTICAL.fullmatch(direction):
        notes.append(f"the channel {direction!r} looks vertical, but it is taken for a horizontal motion")
    text = motion.description.text
    heading, taken = _HEADING_UNITS.search(text), _UNITS.search(text)
    if heading is not None and taken is not None and heading[1] != taken[1]:
        notes.append(f"the file's heading says {heading[1]}, but the numbers are taken for {taken[1]}")
    return tuple(notes)


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
            f"the diagonal of the block is {largest:.3g} m, more than {_LARGEST:g} m: are its sizes in metres?"
        )
    if block.half_width is not None and block.half_height is not None and block.half_width > block.half_height:
        width, height = 2.0 * block.half_width, 2.0 * block.half_height
        notes.append(f"the block is wider, {width:g} m, than it is high, {height:g} m: are the sizes swapped?")
    return tuple(notes)


def _direction(motion: Motion) -> str:
    """Return the name of a record's channel or its direction, or an empty text."""
    found = _CHANNEL.search(motion.description.text)
    return (found[1] or found[2] or "").strip() if found else ""
