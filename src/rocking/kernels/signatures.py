"""Argument types for which kernels are compiled."""

import importlib
from typing import Any

import numpy as np

from rocking.kernels import ground, state
from rocking.kernels.lanes import pool_of
from rocking.kernels.periodic import TRAP, Setting
from rocking.kernels.sine import sequence
from rocking.kernels.trace import Trail


def named(name: str) -> Any:
    """Return a kernel by its name (module and function) in `signatures`."""
    module, _, function = name.rpartition(".")
    return getattr(importlib.import_module(f"rocking.kernels.{module}"), function)


def signatures() -> dict[str, tuple[Any, ...]]:
    """Return sample arguments of each kernel by its name; only their types matter."""

    def reals(*shape: int, kind: Any = np.float64) -> Any:
        return np.ones(shape or (1,), dtype=kind)

    def given(*shape: int) -> Any:
        """Return an array that a kernel only reads."""
        array = reals(*shape)
        array.flags.writeable = False
        return array

    count = reals(1, kind=np.int64)
    flags, singles = reals(1, kind=np.bool_), reals(1, kind=np.float32)
    seen = ground.Ground(reals(3, 4), reals(1, 1, 4), 0.0, 2, 2)
    block, settings, scratch = state.record(state.BLOCK), state.record(state.SETTINGS), state.new_scratch()
    blocks, states, table = state.records(1, state.BLOCK), state.new_states(1, 1), state.new_table(1)
    trail = Trail(seen, block, settings, state.records(1, state.NODE_ROW))
    pool = pool_of(blocks, states, 1, 1.0, 0)
    setting = Setting(seen, block, settings, table, reals(2, 1, 10))
    sequences = (given(), given(), given())
    statuses = reals(1, kind=np.int8)
    shares = (reals(1, 1, kind=np.float32), reals(1, 1, kind=np.float32), reals(1, 1, kind=np.float32), singles)
    return {
        "march.march": (seen, block, settings, table, scratch, states[0]),
        "trace.trace": (trail, scratch, given(), count, reals(1, 3)),
        "trace.vary": (trail, scratch, state.record(state.VARIATION), 0, given(), reals(), reals(), reals()),
        "adjoint.adjoint": (trail, scratch, state.record(state.VARIATION), 0, 0.0, reals(3), reals(2, 2)),
        "adjoint.adjoint_of_final_state": (trail, scratch, 0, reals(3), reals(2, 2)),
        "periodic.iterate": (setting, scratch, states, 1, reals(1, 1, 3), reals(1, TRAP), count, count),
        "periodic.differentiate": (trail, scratch, state.record(state.VARIATION), table, states, reals(1, 2, 2)),
        "periodic.stretch": (trail, scratch, state.record(state.VARIATION), table, states[0], reals(3, 2), reals(1, 2)),
        "uplift.note_complete": (seen, blocks, states, scratch, flags),
        "uplift.next_uplifts": (trail, scratch, reals()),
        "ground.fill": (given(3), given(2, 2), 1.0, seen, reals()),
        "lanes.run_lanes": (seen, settings, scratch, pool, 0),
        "lanes.march_each": (seen, settings, scratch, pool),
        "oscillator.peak_displacements": (given(3), given(2, 2), given(), 0.05, reals(), reals()),
        "sine.series.eq65_sums": (1.0,),
        "sine.series.eq65_terms": (1.0, reals(), reals()),
        "sine.series.series_arcs": (reals(1, 1), True, 1.0, 1.0, reals(1, 1), reals(1, 1), reals(1, 1, 1)),
        "population.shares": (*shares, reals(1, 1, kind=np.float32), reals()),
        "population.log_density": (reals(1, 1), reals(1, 1), reals(), reals()),
        "sine.sequence.rest_phases": (sequences, reals(), statuses),
        "sine.sequence.resolve": (1.0, 1.0, 1.0, 1.0, np.zeros(1, sequence.IMPACT)),
        "sine.sequence.semianalytical_phases": (sequences, count, reals(), statuses),
        "sine.sequence.critical_amplitudes": (given(), given(), reals()),
    }
