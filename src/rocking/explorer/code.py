"""Equivalent Python code and commands for cases, maps and sweeps."""

from __future__ import annotations

from typing import Final

from rocking.core.constants import STANDARD_GRAVITY
from rocking.explorer.inputs import Case
from rocking.explorer.maps import Axis, MapGrid, compute_angular_frequency
from rocking.explorer.parameters import BLOCK_NAMES, PARAMETERS
from rocking.explorer.periodic import RECORDED_PERIOD_COUNT, SWEPT_INPUTS, TRANSIENT_PERIOD_COUNT, Sweep
from rocking.inputs.texts import format_command

_CASE_SCRIPT: Final = """\
import rocking

block = rocking.{block}
{before}motion = {motion}
response = rocking.simulate(block, motion{options})
print(response.summary())"""

_MAP_SCRIPT: Final = """\
import numpy as np

import rocking
from rocking.chattering import chattering_map, families

{before}base = rocking.{block}
xs, ys, model = {xs}, {ys}, {model!r}


def case({y}, {x}):
    sides = {{name: np.array([getattr(side, name) for side in base.sides]) for name in ("p", "alpha", "restitution")}}
{changes}    block = rocking.Block.from_parameters(**sides, gravity=base.gravity)
    return families.SimulationInput(block, {motion}, model)


found = chattering_map(case, {{"{y}": ys, "{x}": xs}})
print(found.summary())


def find_peak(block, motion, _):
    response = rocking.simulate(block, motion, model=model)
    return np.inf if response.overturned else response.peak_rotation / min(side.alpha for side in block.sides)


peaks = [[find_peak(*case(y, x)) for x in xs] for y in ys]
"""

#: Lines that change the sides of a block, and factors on the motion, by the parameter of a map.
_CHANGES: Final = {
    "p": 'sides["p"] *= p / min(sides["p"])',
    "omega": "# A pulse of another frequency is equivalent to a block of another p, in other units of time.\n"
    '    sides["p"] *= {angular_frequency} / omega / min(sides["p"])',
    "alpha": 'sides["alpha"] = np.radians(alpha)',
    "restitution": 'sides["restitution"] = restitution',
}
_PEAKS: Final = {"a": "a * min(block.uplift_thresholds(model))", "pga": f"pga * {STANDARD_GRAVITY!r}"}

_SWEEP_SCRIPT: Final = """\
import numpy as np

import rocking
from rocking import dynamics

block = rocking.{block}


def case({name}):
    return block, rocking.pulses.sine({amplitude}, {frequency}, cycles=1, phase={phase!r})


found = dynamics.bifurcation_diagram(
    case, {values}, (0.0, 0.0), direction="both",
    transient_periods={transient}, recorded_periods={recorded}, parameter={name!r}{options}
)
print(found.summary())
"""


def case_as_python(case: Case) -> str:
    """Write the case as a complete script.

    Examples
    --------
    >>> from rocking.explorer.inputs import read_case
    >>> from rocking.explorer.uploads import UploadStore
    >>> texts = {"p": "2", "alpha": "0.2", "motion": "none", "initial_rotation": "0.02"}
    >>> print(case_as_python(read_case(texts, UploadStore())))
    import rocking
    <BLANKLINE>
    block = rocking.Block.from_parameters(p=2.0, alpha=0.2)
    motion = None
    response = rocking.simulate(block, motion, initial_rotation=0.02)
    print(response.summary())
    """
    options = "".join(f", {name}={value!r}" for name, value in case.options.items())
    motion = {"before": case.motion_preamble, "motion": case.motion_expression}
    return _CASE_SCRIPT.format(block=case.block_expression, **motion, options=options)


def case_as_command(case: Case) -> str | None:
    """Write the case as a command, or return None if the command line does not support it.

    Examples
    --------
    >>> from rocking.explorer.inputs import read_case
    >>> from rocking.explorer.uploads import UploadStore
    >>> texts = {"p": "2", "alpha": "12deg", "motion": "ridgecrest-clc-090", "sa": "0.4g@1"}
    >>> case_as_command(read_case(texts, UploadStore()))
    'rocking simulate ridgecrest-clc-090 --p 2 --alpha 12deg --sa 0.4g@1'
    """
    if not case.words or "gravity" in case.texts:
        return None
    excluded = {*BLOCK_NAMES, "motion", "vertical"}
    options = {**case.block_options} | {
        name: case.texts[name] for name in PARAMETERS if name in {*case.texts} - excluded
    }
    return format_command(["rocking", "simulate", *case.words], options)


def map_as_python(grid: MapGrid) -> str:
    """Write a complete script that computes a map."""
    case, names = grid.case, (grid.x.name, grid.y.name)
    changes = [_CHANGES[name] for name in _CHANGES if name in names]
    if "alpha" in names and "restitution" not in {*case.texts, *names}:
        changes.append('del sides["restitution"]  # follows from alpha')
    if "omega" in names:
        changes = [change.replace("{angular_frequency}", repr(compute_angular_frequency(case))) for change in changes]
    return _MAP_SCRIPT.format(
        before=case.motion_preamble,
        block=case.block_expression,
        x=names[0],
        y=names[1],
        xs=_format_axis(grid.x),
        ys=_format_axis(grid.y),
        changes="".join(f"    {change}\n" for change in changes),
        motion=case.motion_expression + "".join(f".scaled_to({_PEAKS[name]})" for name in names if name in _PEAKS),
        model=case.model,
    )


def sweep_as_python(sweep: Sweep) -> str:
    """Write a complete script that computes a bifurcation diagram."""
    case, sine, name = sweep.case, sweep.sine, sweep.axis.name
    options = {name: case.options[name] for name in ("model", "chattering") if name in case.options}
    numbers = {"amplitude": repr(sine.amplitude), "frequency": repr(sine.frequency)}
    return _SWEEP_SCRIPT.format(
        **numbers | {SWEPT_INPUTS[name]: f"{name} * {sweep.unit!r}"},
        block=case.block_expression,
        phase=sine.phase,
        options="".join(f", {option}={value!r}" for option, value in options.items()),
        name=name,
        values=_format_axis(sweep.axis),
        recorded=RECORDED_PERIOD_COUNT,
        transient=TRANSIENT_PERIOD_COUNT,
    )


def _format_axis(axis: Axis) -> str:
    return f"np.linspace({float(axis.values[0])!r}, {float(axis.values[-1])!r}, {len(axis.values)})"
