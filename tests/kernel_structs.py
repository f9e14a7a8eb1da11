"""Blocks, motions, rules and states as kernels take them, stated in few words."""

import math
from collections.abc import Sequence

import numpy as np
import pytest
from hypothesis import strategies as st
from oracles.problem import Problem

from rocking.kernels import state
from rocking.kernels.compiled import UNCOMPILED
from rocking.kernels.ground import Ground
from rocking.kernels.ground import build_ground as laid_out
from rocking.kernels.state import Struct

GRAVITY = 9.80665
ULP = 2.0**-52
PLUS, MINUS = 0, 1

long_uncompiled = pytest.mark.skipif(UNCOMPILED, reason="takes long without compilation")

Pair = tuple[float, float]


def in_units_of_g(
    breakpoints: Sequence[float],
    coefficients: Sequence[Sequence[float]],
    error: float = 0.0,
    vertical: Sequence[Sequence[float]] | None = None,
) -> Ground:
    upright = None if vertical is None else np.array(vertical, dtype=float)
    return laid_out(np.array(breakpoints, dtype=float), np.array(coefficients, dtype=float), 1.0, error, upright)


#: No motion at all.
NO_GROUND = laid_out(np.zeros(1), np.zeros((0, 2)), 1.0, 0.0)


def rocking_block(
    p: Pair = (2.0, 2.0),
    alpha: Pair = (0.15, 0.15),
    e: Pair = (0.9, 0.9),
    *,
    nonlinear: bool = False,
    limit: float = 0.0,
    fallen: float = 0.5 * math.pi,
) -> Struct:
    p, alpha = np.array(p, dtype=float), np.array(alpha, dtype=float)
    return state.create_struct(
        state.BLOCK_DTYPE,
        stiffness=p * p,
        slenderness=alpha,
        sine=np.sin(alpha),
        cosine=np.cos(alpha),
        threshold=np.tan(alpha) if nonlinear else alpha,
        restoring_gain=p * p * np.cos(alpha) if nonlinear else p * p,
        restitution=e,
        rest_limit=limit,
        next_side=(1, 0),
        overturn_angle=fallen,
    )


def one_sided(stiffness: float, gain: float, threshold: float, e: float) -> Struct:
    """Something that bounces on one side: u'' = stiffness u - gain (threshold + a), and back with e times the speed."""
    return state.create_struct(
        state.BLOCK_DTYPE,
        stiffness=stiffness,
        threshold=(threshold, math.inf),
        restoring_gain=gain,
        restitution=e,
        next_side=(0, 0),
        overturn_angle=math.inf,
    )


def rules_for(
    *,
    nonlinear: bool = False,
    rest_rule: int = state.RestRule.CERTIFIED,
    tolerance: float = 1e-12,
    stop: float = math.inf,
    writes_tables: bool = True,
) -> Struct:
    return state.create_struct(
        state.SETTINGS_DTYPE,
        nonlinear=nonlinear,
        rest_rule=rest_rule,
        tolerance=tolerance,
        stop_time=stop,
        no_end_time=stop == math.inf,
        writes_tables=writes_tables,
    )


def state_of(side: int, u: float, v: float, *, piece: int = 0, offset: float = 0.0, **others: float) -> Struct:
    """A block on its way: a march goes on from here to the end."""
    made = state.create_states(1, 10**6)[0]
    for name, value in {"side": side, "u": u, "v": v, "piece": piece, "offset": offset, "peak": u, **others}.items():
        made[name] = value
    return made


def block_of(problem: Problem) -> Struct:
    return rocking_block(problem.p, problem.alpha, problem.restitution, nonlinear=problem.model == "nonlinear")


def ground_of(problem: Problem, error: float = 0.0) -> Ground:
    return laid_out(problem.breakpoints, problem.coefficients, 1.0 / problem.gravity, error)


def numbers(low: float, high: float) -> st.SearchStrategy[float]:
    """Draw numbers far from underflow."""
    return st.floats(low, high).map(lambda x: x if abs(x) > 1e-30 else 0.0)
