"""Regions whose boundaries are known at some abscissae only: how those of two neighbours meet.

The rule, between one abscissa and the next:

- A boundary between the same two regions on both sides runs straight from one to the other.
- A region that only one side has ends in a tip half way: it is there, it is gone at the neighbour, and where between
  them it ends is not known. The same holds from the neighbour's side for a region that begins.
- Where each side has a region in the place of the other's, the two meet at an upright line half way.
- A boundary that would end in a tip at the frame's edge runs on straight instead, until half way or out of the frame.

So nothing is drawn that neither side has, and nothing is drawn beyond half the way to where it is known to be absent.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from rocking.core.arrays import Flags, Floats


class Stack(NamedTuple):
    """Regions at one abscissa, from the lowest, and their boundaries; the first and the last are those of the frame."""

    level: Floats
    region: tuple[int, ...]

    @property
    def path(self) -> tuple[int | None, ...]:
        """Regions, with what is outside the frame (None) at both ends: boundary k is between entries k and k + 1."""
        return None, *self.region, None


def runs(x: Floats, stacks: Sequence[Stack]) -> Iterator[tuple[Floats, Floats, tuple[int, ...]]]:
    """Yield runs of abscissae with the same regions: abscissae, levels of shape (regions + 1, abscissae), regions."""
    starts = [k for k in range(len(x)) if k == 0 or stacks[k].region != stacks[k - 1].region]
    ends = [*starts[1:], len(x)]
    met = [meeting(stacks[end - 1], stacks[end]) for end in ends[:-1]]
    for run, (start, end) in enumerate(zip(starts, ends, strict=True)):
        inner = x[start:end]
        levels = np.stack([stack.level for stack in stacks[start:end]], axis=1)
        before, after = [], []
        if start > 0:
            at = 0.5 * (x[start - 1] + x[start])
            before = [(at, _led_on(inner, levels, at, met[run - 1][1]))]
        if end < len(x):
            at = 0.5 * (x[end - 1] + x[end])
            after = [(at, _led_on(inner[::-1], levels[:, ::-1], at, met[run][0]))]
        whole = [*before, *zip(inner, levels.T, strict=True), *after]
        yield np.array([at for at, _ in whole]), np.stack([level for _, level in whole], axis=1), stacks[start].region


def _led_on(x: Floats, levels: Floats, at: float, half: Floats) -> Floats:
    """Levels half way, after those of a run, the nearest abscissa first: straight on where they leave the frame."""
    if len(x) < 2:
        return half
    low, high = half[0], half[-1]
    nearest, next_one = levels[:, 0], levels[:, 1]
    straight = nearest + (at - x[0]) / (x[0] - x[1]) * (nearest - next_one)
    leaves = (half == high) & (straight > nearest) | (half == low) & (straight < nearest)
    return np.sort(np.where(leaves, np.clip(straight, low, high), half))


def meeting(left: Stack, right: Stack) -> tuple[Floats, Floats]:
    """Levels, half way between two neighbours, of the boundaries of the left one and of those of the right one."""
    shared = _shared(left, right)
    one, other = _Side(left), _Side(right)
    for i, j in shared:
        _join(one, slice(i, i + 1), other, slice(j, j + 1))
    ends = len(left.level), len(right.level)
    for (i, j), (k, m) in pairwise([(-1, -1), *shared, ends]):
        _close(one, _parts(left.path, i + 1, k), other, _parts(right.path, j + 1, m))
    return one.halves(), other.halves()


class _Side:
    """What becomes of one side's boundaries half way to the other: `half`, where it is known already."""

    def __init__(self, stack: Stack) -> None:
        self.path, self.level, self.at = stack.path, stack.level, stack.level.copy()
        self.half = np.full(self.level.size, np.nan)

    def ends(self, part: slice) -> tuple[float, float]:
        """Levels of the first and the last boundary of a part."""
        return float(self.level[part.start]), float(self.level[part.stop - 1])

    def taper(self, part: slice) -> None:
        """Let a part end in a tip."""
        self.at[part] = np.mean(self.ends(part))

    def halves(self) -> Floats:
        """Levels half way."""
        known = ~np.isnan(self.half)
        return np.sort(np.where(known, self.half, np.interp(self.at, self.at[known], self.half[known])))


class _Parts(NamedTuple):
    """Boundaries between two shared ones: loops back to the region they leave, and the chain that is no loop."""

    loops: list[slice]
    chain: slice


def _parts(path: Sequence[int | None], start: int, end: int) -> _Parts:
    """Split the boundaries on the path from one entry to another."""
    first, last = path[start], path[end]
    leaves = max(k for k in range(start, end + 1) if path[k] == first)
    arrives = leaves if first == last else path.index(last, leaves)
    at_first = [k for k in range(start, leaves + 1) if path[k] == first]
    at_last = [k for k in range(arrives, end + 1) if path[k] == last]
    loops = [slice(*ends) for visits in (at_first, at_last) for ends in pairwise(visits)]
    return _Parts(loops, slice(leaves, arrives))


def _close(one: _Side, left: _Parts, other: _Side, right: _Parts) -> None:
    """Let the boundaries between two shared ones meet those of the other side, or end in tips."""
    if left.chain.start < left.chain.stop:
        _join(one, left.chain, other, right.chain)
    if len(left.loops) == len(right.loops) and all(
        _overlap(one.ends(here), other.ends(there)) for here, there in zip(left.loops, right.loops, strict=True)
    ):
        for here, there in zip(left.loops, right.loops, strict=True):
            _join(one, here, other, there)
        return
    for side, loops in ((one, left.loops), (other, right.loops)):
        for loop in loops:
            side.taper(loop)


def _overlap(one: tuple[float, float], other: tuple[float, float]) -> bool:
    return max(one[0], other[0]) <= min(one[1], other[1])


def _join(one: _Side, here: slice, other: _Side, there: slice) -> None:
    """Lead the ends of a part to those of the other side's; where either has one boundary only, both to one point."""
    for i in range(here.start + 1, here.stop):
        for j in range(there.start + 1, there.stop):
            if one.path[i] == other.path[j]:
                _join(one, slice(here.start, i), other, slice(there.start, j))
                _join(one, slice(i, here.stop), other, slice(j, there.stop))
                return
    low, high = (0.5 * (mine + theirs) for mine, theirs in zip(one.ends(here), other.ends(there), strict=True))
    if 1 in (here.stop - here.start, there.stop - there.start):
        if here.start == 0:  # The frame's boundaries stay where they are.
            high = low
        elif here.stop == one.level.size:
            low = high
        else:
            low = high = 0.5 * (low + high)
    for side, part in ((one, here), (other, there)):
        side.half[part.start], side.half[part.stop - 1] = low, high


def _shared(left: Stack, right: Stack) -> list[tuple[int, int]]:
    """Pairs of boundaries between the same regions: as many as there can be, and of those the nearest to each other."""
    if left.region == right.region:
        return [(k, k) for k in range(left.level.size)]
    # All distances together count for less than one pair.
    weight = 1.0 / ((left.level[-1] - left.level[0]) * (left.level.size + 1.0))
    gain = 1.0 - weight * np.abs(left.level[:, None] - right.level)
    gain[~_alike(left, right)] = -np.inf
    # What the boundaries from (i, j) on are worth: without i, without j, or with both.
    best = np.zeros((left.level.size + 1, right.level.size + 1))
    for i in reversed(range(left.level.size)):
        best[i, :-1] = np.maximum(best[i + 1, :-1], gain[i] + best[i + 1, 1:])
        best[i] = np.maximum.accumulate(best[i, ::-1])[::-1]
    pairs, i, j = [], 0, 0
    while i < left.level.size and j < right.level.size:
        if best[i, j] == best[i + 1, j]:
            i += 1
        elif best[i, j] == best[i, j + 1]:
            j += 1
        else:
            pairs.append((i, j))
            i, j = i + 1, j + 1
    return pairs


def _alike(left: Stack, right: Stack) -> Flags:
    """Whether a boundary of the left one is between the same regions as one of the right one, for all pairs of them."""
    numbers = {kind: k for k, kind in enumerate({*pairwise(left.path), *pairwise(right.path)})}
    one, other = (np.array([numbers[kind] for kind in pairwise(stack.path)]) for stack in (left, right))
    same: Flags = one[:, None] == other
    return same
