"""Argument types for which kernels are compiled."""

import importlib
from typing import Any

import numpy as np

from rocking.kernels import ground, state
from rocking.kernels.lanes import build_pool
from rocking.kernels.periodic import TRAP_COLUMNS, PeriodicProblem
from rocking.kernels.sine import sequence
from rocking.kernels.trace import Trail


def find_kernel(name: str) -> Any:
    """Return a kernel by its name (module and function) in `sample_arguments`."""
    module, _, function = name.rpartition(".")
    return getattr(importlib.import_module(f"rocking.kernels.{module}"), function)


def sample_arguments() -> dict[str, tuple[Any, ...]]:
    """Return sample arguments of each kernel by its name; only their types matter."""

    def array(*shape: int, dtype: Any = np.float64) -> Any:
        return np.ones(shape or (1,), dtype=dtype)

    def fixed(*shape: int) -> Any:
        """Return an array that a kernel only reads."""
        values = array(*shape)
        values.flags.writeable = False
        return values

    count = array(1, dtype=np.int64)
    flags, singles = array(1, dtype=np.bool_), array(1, dtype=np.float32)
    sample = ground.Ground(array(3, 4), array(1, 1, 2), 0.0, 2, 2, 1.0, 1.0)
    block, settings = state.create_struct(state.BLOCK_DTYPE), state.create_struct(state.SETTINGS_DTYPE)
    variation, scratch = state.create_struct(state.VARIATION_DTYPE), state.create_scratch()
    blocks, states, table = state.create_structs(1, state.BLOCK_DTYPE), state.create_states(1, 1), state.create_table(1)
    trail = Trail(sample, block, settings, state.create_structs(1, state.NODE_DTYPE))
    grounds, motions = ground.join_grounds([sample]), array(1, dtype=np.int64)
    pool = build_pool(grounds, motions - 1, array(1), blocks, states, 1.0, 0)
    problem = PeriodicProblem(sample, block, settings, table, array(2, 1, 10))
    sequences = (fixed(), fixed(), fixed())
    statuses = array(1, dtype=np.int8)
    population = (array(1, 1, dtype=np.float32), array(1, 1, dtype=np.float32), array(1, 1, dtype=np.float32), singles)
    return {
        "march.march": (sample, block, settings, table, scratch, states[0]),
        "trace.trace": (trail, scratch, fixed(), count, array(1, 3)),
        "trace.compute_variation": (trail, scratch, variation, 0, fixed(), array(), array(), array()),
        "adjoint.adjoint": (trail, scratch, variation, 0, 0.0, array(3), array(2, 2)),
        "adjoint.differentiate_step_end": (trail, scratch, 0, array(3), array(2, 2)),
        "periodic.iterate_periods": (problem, scratch, states, 1, array(1, 1, 3), array(1, TRAP_COLUMNS), count, count),
        "periodic.differentiate_periods": (trail, scratch, variation, table, states, array(1, 2, 2)),
        "periodic.measure_stretches": (trail, scratch, variation, table, states[0], array(3, 2), array(1, 2)),
        "uplift.write_completeness": (grounds, motions, array(1), blocks, states, scratch, flags),
        "uplift.write_next_uplifts": (trail, scratch, array()),
        "ground.write_pieces": (fixed(3), fixed(2, 2), sample, array()),
        "lanes.run_lanes": (settings, scratch, pool, 0),
        "lanes.march_blocks": (settings, scratch, pool),
        "oscillator.write_peak_displacements": (fixed(3), fixed(2, 2), fixed(), 0.05, array(), array()),
        "sine.series.sum_eq65": (1.0,),
        "sine.series.write_eq65_terms": (1.0, array(), array()),
        "sine.series.write_arc_series": (array(1, 1), True, 1.0, 1.0, array(1, 1), array(1, 1), array(1, 1, 1)),
        "population.write_overturned_fractions": (*population, array(1, 1, dtype=np.float32), array()),
        "population.write_log_sums": (array(1, 1), array(1, 1), array(), array()),
        "sine.sequence.write_rest_phases": (sequences, array(), statuses),
        "sine.sequence.resolve_impacts": (1.0, 1.0, 1.0, 1.0, np.zeros(1, sequence.RESOLVED_IMPACT)),
        "sine.sequence.write_semianalytical_phases": (sequences, count, array(), statuses),
        "sine.sequence.write_critical_amplitudes": (fixed(), fixed(), array()),
    }
