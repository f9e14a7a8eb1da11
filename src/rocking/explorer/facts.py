"""Numbers and words about a case: what stands, what shakes it, and what becomes of it."""

from __future__ import annotations

import functools
import math
from typing import Any

import numpy as np

from rocking.arrays import Floats
from rocking.block import Block
from rocking.chattering.maps import chattering_episodes
from rocking.constants import STANDARD_GRAVITY
from rocking.explorer.phrases import phrase
from rocking.explorer.simulated import Simulated, drifts
from rocking.motion.motion import Motion
from rocking.plausibility import block_notes, motion_notes
from rocking.response import Response, in_words, known_ratio


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
    return phrase("verdict.stays", share=_percent(known_ratio(response)), resting=resting)


def _percent(share: float) -> dict[str, Any]:
    """Write a share in percent: two digits, and four about the whole, where they decide."""
    value = 100.0 * share
    return phrase("verdict.percent", value=value) if share < 0.99 else phrase("verdict.near_percent", value=value)


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
