"""A case with its response, and its numbers and words: what stands, what shakes it, and what becomes of it."""

from __future__ import annotations

import functools
import math
from dataclasses import dataclass, replace
from typing import Any, Final

import numpy as np

from rocking.block import Block
from rocking.chattering.maps import chattering_episodes
from rocking.core.arrays import Floats
from rocking.core.constants import STANDARD_GRAVITY
from rocking.engine.treatment import Certified
from rocking.explorer.inputs import Case
from rocking.explorer.payload import phrase
from rocking.inputs.notes import block_notes, motion_notes
from rocking.motion.motion import Motion
from rocking.response import Response, in_words, known_ratio

#: Bracket on a time of rest, s, with which impacts are resolved for a window close to it: some nanoseconds are left.
_FINEST: Final = Certified(1e-40)

#: Ground motion of longer periods than this (s) is not drawn where a record's baseline would drift.
_LONGEST_PERIOD: Final = 10.0


@dataclass(frozen=True, eq=False)
class Simulated:
    """A case with its response, and what is made of it when it is first asked for."""

    case: Case
    response: Response

    @functools.cached_property
    def fine(self) -> Response:
        """The same response with more impacts resolved before each proven rest."""
        if self.case.treatment.name != _FINEST.name:
            return self.response
        fine = replace(self.case, treatment=_FINEST).simulate()
        return fine if fine.stalled == self.response.stalled else self.response

    def resolved(self, start: float, end: float) -> Response:
        """Return the response whose impacts are resolved as far as a window shows."""
        return self.fine if unresolved(self.response, start, end) else self.response

    @functools.cached_property
    def outline(self) -> Floats | None:
        """Trapezoids of the outline of a mesh, in the plane in which it rocks; None of another block."""
        return None if self.case.body is None else self.case.body.across(self.case.azimuth)

    @functools.cached_property
    def ground(self) -> Motion | None:
        """The horizontal motion whose displacement is drawn: of a record the part that does not drift away."""
        if self.case.motion is None:
            return None
        motion = self.case.motion.with_vertical(None)
        return motion.processed(baseline=1, band_pass=(1.0 / _LONGEST_PERIOD, None)) if drifts(motion) else motion


def unresolved(response: Response, start: float, end: float) -> list[float]:
    """Return the times, s, from the last resolved impact to the rest, of sequences whose end is seen in a window."""
    ends = np.asarray(response.chattering["end"], dtype=float)
    impact_times = np.asarray(response.impacts["time"], dtype=float)
    last = impact_times[np.searchsorted(impact_times, ends, side="right") - 1]
    seen = (ends > start) & (last < end) & (ends - last > 1e-3 * (end - start))
    return [float(each) for each in (ends - last)[seen]]


def drifts(motion: Motion) -> bool:
    """Whether the displacement of a motion is that of a record, and can be filtered."""
    long_enough = motion.step is not None and motion.duration > 2.0 * _LONGEST_PERIOD > 20.0 * motion.step
    return long_enough and motion.coefficients.shape[1] == 2 and not motion.jumps


def facts(shown: Simulated) -> dict[str, Any]:
    """Return the numbers that a page shows of a case, and the sentence above them."""
    case, response = shown.case, shown.response
    block, motion = case.block, case.motion
    episodes = chattering_episodes(response)
    return {
        "block": {
            "description": block.description,
            "sides": [vars(side) for side in block.sides],
            "symmetric": block.is_symmetric,
            "thresholds_g": [each / STANDARD_GRAVITY for each in block.uplift_thresholds(case.model)],
            "gravity_g": block.gravity / STANDARD_GRAVITY,
            "outline": _outline(block, shown.outline),
            "notes": [*map(str, block_notes(block)), *(case.body.solid.notes if case.body else ())],
            "body": None if case.body is None else case.body.plane(case.azimuth),
        },
        "motion": None if motion is None else _motion_facts(motion),
        "model": case.model,
        "treatment": str(case.treatment),
        "duration": response.duration,
        "overturned": response.overturned,
        "unfinished": response.unfinished,
        "overturn_time": response.overturn_time,
        "tipping_time": response.tipping_time,
        "peak_rotation": response.peak_rotation,
        "peak_over_slenderness": known_ratio(response),
        "peak_time": response.peak_time,
        "impacts": len(response.impacts),
        "rests": int(np.sum(response.events["kind"] == "rest")),
        "proven": int(np.sum(~np.isnan(response.chattering["upper"]))),
        "time_at_rest": response.time_at_rest,
        "share_at_rest": episodes.share_at_rest,
        "eta_squared": math.prod(side.restitution for side in block.sides),
        "verdict": verdict(response, block.uplift_thresholds(case.model)),
    }


def verdict(response: Response, thresholds: tuple[float, float]) -> dict[str, Any] | str:
    """Say in one sentence what becomes of a block lifted by these accelerations (m/s^2): first whether it falls."""
    if response.stopped:
        words = in_words(response, "")
        return f"{words[0].upper()}{words[1:]}."
    if not len(response.events) and not len(response.impacts) and response.peak_rotation == 0.0:
        if response.motion is None:
            return phrase("verdict.still")
        if response.motion.vertical is not None:
            return phrase("verdict.unlifted")
        return phrase("verdict.below", lifting=min(thresholds))
    near = response.perturbed()
    if not near.is_decided:
        return phrase("verdict.undecided", overturned=int(near.overturned.sum()), count=len(near.repeats))
    rests = int(np.sum(response.events["kind"] == "rest"))
    if response.overturned:
        time = response.overturn_time
        return (
            phrase("verdict.overturns_later", time=time, count=rests)
            if rests
            else phrase("verdict.overturns", time=time)
        )
    if response.unfinished:
        return phrase("verdict.given_up", time=response.duration)
    unproven = rests - int(np.sum(~np.isnan(response.chattering["upper"])))
    resting = phrase("verdict.rests", count=rests) if rests else phrase("verdict.no_rest")
    if unproven:
        resting = phrase("verdict.unproven", rests=resting, unproven=unproven)
    ratio = known_ratio(response)
    # Two digits, and four about the whole, where they decide.
    share = phrase("verdict.percent" if ratio < 0.99 else "verdict.near_percent", value=100.0 * ratio)
    return phrase("verdict.stays", share=share, resting=resting)


@functools.lru_cache(maxsize=4)
def _motion_facts(motion: Motion) -> dict[str, Any]:
    """Say what a motion is, found once while only the block is changed."""
    return {
        "name": motion.name,
        "duration": motion.duration,
        "pga_g": motion.pga / STANDARD_GRAVITY,
        "vertical": motion.vertical and {"name": motion.vertical.name, "pga_g": motion.vertical.pga / STANDARD_GRAVITY},
        "notes": list(motion_notes(motion)),
        "filtered": drifts(motion),
    }


def _outline(block: Block, outline: Floats | None) -> dict[str, Any]:
    """Corners of the block as it stands (m), or trapezoids (n, 6), its centre of mass at distance 0, and its extent."""
    right, left = (side.radius * math.sin(side.alpha) for side in block.sides)
    heights = [side.radius * math.cos(side.alpha) for side in block.sides]
    centre = 0.5 * (heights[0] + heights[1])
    shape = {"left": left, "right": right, "centre": centre}
    if outline is None:
        return {**shape, "top": 2.0 * centre, "widest": max(left, right)}
    return {**shape, "top": float(outline[:, 1].max()), "widest": float(np.abs(outline[:, 2:]).max())}
