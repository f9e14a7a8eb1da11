"""What became of a block: never more than the simulation knows."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from rocking.response.digits import brief_overturn_text

if TYPE_CHECKING:
    from rocking.response.response import Response


def in_words(response: Response, overturn_time: str) -> str:
    """Return what became of the block, for its summary; the time at which it overturns is given as text."""
    if response.overturned:
        return f"overturns at {overturn_time}"
    if response.unfinished:
        return f"UNFINISHED: given up at {response.duration:.4f} s, after too many steps"
    if response.stopped:
        return f"{_when_stopped(response)}, where the simulation was stopped{_still_to_come(response)}"
    return "rocks and does not overturn" if _has_moved(response) else "does not move"


def in_brief(response: Response) -> str:
    """Return what became of the block, for a row of a table."""
    doubtful = ", AMBIGUOUS" if response.ambiguous else ""
    return f"{_brief(response)}{doubtful}"


def _brief(response: Response) -> str:
    if response.overturned:
        return f"overturns at {brief_overturn_text(response)}"
    if response.unfinished:
        return f"unfinished, given up at {response.duration:.2f} s"
    if response.stopped:
        return _when_stopped(response)
    return "rocks" if _has_moved(response) else "does not move"


def _when_stopped(response: Response) -> str:
    end = f"{response.duration:.6g} s"
    if not math.isnan(response.tipping_time):
        return f"beyond its balance point since {response.tipping_time:.4f} s and not yet fallen at {end}"
    if response.moves_at_end:
        return f"still rocking at {end}"
    return f"at rest at {end}" if _has_moved(response) else f"has not moved by {end}"


def _still_to_come(response: Response) -> str:
    motion = response.motion
    if motion is None or not response.duration < motion.end:
        return ""
    return f"; the motion goes on to {motion.end:.6g} s"


def _has_moved(response: Response) -> bool:
    return bool(len(response.events) or len(response.impacts) or response.peak_rotation > 0.0)
