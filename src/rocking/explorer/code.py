"""A case, and a map of it, as Python and as a command that compute the same."""

from __future__ import annotations

import math
from typing import Any, Final

from rocking.analysis.overturning import PULSES
from rocking.core.constants import STANDARD_GRAVITY
from rocking.explorer.inputs import Case
from rocking.explorer.maps import Axis, MapGrid, sign_of
from rocking.explorer.motions import arguments_of, is_pulse, pulse_call
from rocking.explorer.parameters import BLOCK_NAMES, NAMES, QUANTITIES
from rocking.explorer.periodic import KEPT, PASSED, Sweep, call_at
from rocking.inputs.texts import command_line

_CHATTERING: Final = """\
import math

import numpy as np

import rocking
from rocking.chattering import chattering_map, families


{before}def case({y}, {x}):
    block = rocking.{block}
    motion = {motion}
    return families.SimulationInput(block, motion, {model!r})


found = chattering_map(case, {{"{y}": {ys}, "{x}": {xs}}})
print(found.summary())
"""

_MANY: Final = """\
import numpy as np

import rocking

{before}motion = {motion}
xs, ys = {xs}, {ys}


def block_at({names}):
    return rocking.{block}


blocks = {blocks}
{outcomes}


def kept(name):
    return {kept}


{found}
print(found)
"""

#: What is made of the outcomes of many simulations, as the map has it.
_FOUND: Final = {
    "rest": """\
# Time, s, from the first uplift to the first rest; NaN where the block never rests.
found = np.where(kept("rests") > 0, kept("first_rest") - kept("first_uplift"), np.nan){in_seconds}""",
    "peak": """\
# Peak rotation over the slenderness, the smaller one of two; infinite where the block overturns.
slenderness = np.array([min(side.alpha for side in block.sides) for block in blocks]).reshape(-1, len(xs))
found = np.where(kept("overturned"), np.inf, kept("peak_rotation") / slenderness)""",
    "mode": """\
# -4: overturns after a rest; -3: no uplift; -2: rests before the motion is over; -1: rocks; else overturns, and after
# how many impacts.
rested = (kept("uplifts") > 1) | ((kept("rests") > 0) & (kept("last_rest") <= motion.duration))
found = np.where(kept("uplifts") == 0, -3, np.where(rested, -2, -1))
found = np.where(kept("overturned"), np.where(kept("uplifts") > 1, -4, kept("impacts")), found)""",
}

_SWEEP: Final = """\
{imports}import numpy as np

import rocking
from rocking import dynamics

block = rocking.{block}


def case({name}):
    return block, {motion}


rock = dynamics.stroboscopic_map(*case({at!r}){options})
print(rock.orbit(({rotation!r}, {velocity!r}), {last})[-{kept}:])

found = dynamics.bifurcation_diagram(
    case, {values}, (0.0, 0.0), direction="both", transient={transient}, kept={kept}, parameter={name!r}{options}
)
print(found.summary())
"""


def case_as_python(case: Case) -> str:
    """Write the case as a script that runs as it stands.

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
    numbers = {
        "model": None if case.model == "nonlinear" else case.model,
        "chattering": case.texts.get("chattering"),
        "duration": case.duration,
        "initial_rotation": case.initial_rotation or None,
        "initial_velocity": case.initial_velocity or None,
    }
    options = "".join(f", {name}={value!r}" for name, value in numbers.items() if value is not None)
    return "\n".join(
        [
            "import rocking",
            "",
            f"block = rocking.{case.block_call}",
            *filter(None, [case.motion_before]),
            f"motion = {case.motion_call}",
            f"response = rocking.simulate(block, motion{options})",
            "print(response.summary())",
        ]
    )


def case_as_command(case: Case) -> str | None:
    """Write the case as a command; None for what the command line does not do.

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
    left_out = {*BLOCK_NAMES, "motion", "vertical"}
    options = {**case.block_options} | {name: case.texts[name] for name in NAMES if name in {*case.texts} - left_out}
    return command_line(["rocking", "simulate", *case.words], options)


def map_as_python(grid: MapGrid, quantity: str) -> str:
    """Write a script that computes a quantity of a map; it runs as it stands."""
    texts = {"x": grid.x.name, "y": grid.y.name, "xs": _values(grid.x), "ys": _values(grid.y)}
    before = grid.case.motion_before
    if quantity == "outcome":
        texts |= {"block": _block(grid), "motion": _motion(grid), "before": before and f"{before}\n\n\n"}
        return _CHATTERING.format(**texts, model=grid.case.model)
    model = grid.case.model
    options = ", times=True" + (f", model={model!r}" if model != "nonlinear" else "")
    levels = grid.y.name in ("a", "pga")
    outcomes = f"outcomes = rocking.simulate_many(blocks, motion{options})"
    kept = "outcomes[name].values.reshape(len(ys), len(xs))"
    if levels:
        lifting = f"min({{}}.uplift_thresholds({model!r}))" if grid.y.name == "a" else repr(STANDARD_GRAVITY)
        many = f'rocking.simulate_many({{}}, motion, levels=ys * {lifting}, measure="pga"{options})'
        outcomes = "outcomes = " + many.format("blocks", "blocks[0]")
        if (grid.x.name, grid.y.name) == ("alpha", "a"):
            # Each slenderness has a threshold of its own.
            outcomes = f"outcomes = [{many.format('block', 'block')} for block in blocks]"
            kept = "np.stack([each[name].values.ravel() for each in outcomes], axis=1)"
    at = f"{grid.x.name}=x" if levels else f"{grid.y.name}=y, {grid.x.name}=x"
    each = "for x in xs" if levels else "for y in ys for x in xs"
    return _MANY.format(
        **texts,
        before=before and f"{before}\n",
        motion=grid.case.motion_call,
        names=grid.x.name if levels else f"{grid.y.name}, {grid.x.name}",
        block=_block(grid, by_size=True),
        blocks=f"[block_at({at}) {each}]",
        outcomes=outcomes,
        kept=kept,
        found=_FOUND[quantity].format(in_seconds=_in_seconds(grid)),
    )


def map_as_command(grid: MapGrid) -> str | None:
    """Write a map of overturning as a command; None for what the command line does not map."""
    texts = grid.case.texts
    is_of_pulse = texts.get("motion", "").partition(":")[0] in PULSES
    if not is_of_pulse or (grid.x.name, grid.y.name) != ("omega", "a") or "gravity" in texts:
        return None
    name, given = texts["motion"].partition(":")[0], arguments_of(texts["motion"])
    if "duration" in given:  # the command has no cut pulses
        return None
    # The amplitudes of the command are positive, which is another motion only where the sides differ.
    if given["amplitude"] * sign_of(texts) < 0.0 and not grid.case.block.is_symmetric:
        return None
    options: dict[str, str] = {
        "amplitudes": _range(grid.y),
        "frequencies": _range(grid.x),
        **{each: str(value) for each, value in given.items() if each not in ("amplitude", "frequency")},
        **block_options(grid.case),
    }
    return command_line(["rocking", "map", name], options)


def map_as_code(grid: MapGrid) -> dict[str, Any]:
    """Return a script for every quantity, and the command for those that it computes."""
    command = map_as_command(grid)
    return {
        "python": {each: map_as_python(grid, each) for each in QUANTITIES},
        "command": dict.fromkeys(("peak", "mode"), command),
    }


def sweep_as_python(sweep: Sweep) -> str:
    """Write a script that computes what a case settles on, and a sweep; it runs as it stands."""
    case, name = sweep.case, sweep.axis.name
    given = {"model": case.model, "chattering": case.texts.get("chattering")}
    return _SWEEP.format(
        block=case.block_call,
        motion=call_at(sweep),
        options="".join(f", {option}={value!r}" for option, value in given.items() if value is not None),
        imports="import math\n\n" if name == "omega" else "",
        name=name,
        at=sweep.value,
        values=_values(sweep.axis),
        rotation=case.initial_rotation,
        velocity=case.initial_velocity,
        kept=KEPT,
        transient=PASSED - 1,
        last=PASSED + KEPT - 1,
    )


def sweep_as_code(sweep: Sweep) -> dict[str, Any]:
    """Return the script of a sweep; the command line does not sweep."""
    return {"python": sweep_as_python(sweep), "command": None}


def block_options(case: Case) -> dict[str, str]:
    """Options that describe the block and its model."""
    return {**case.block_options, **{each: case.texts[each] for each in ("model",) if each in case.texts}}


def _values(axis: Axis) -> str:
    return f"np.linspace({float(axis.values[0])!r}, {float(axis.values[-1])!r}, {len(axis.values)})"


def _range(axis: Axis) -> str:
    return f"{float(axis.values[0])!r}:{float(axis.values[-1])!r}:{len(axis.values)}"


def _block(grid: MapGrid, *, by_size: bool = False) -> str:
    """Call that makes the block, with the axes' names as arguments; ``by_size`` in place of the pulse's frequency."""
    varied = {grid.x.name, grid.y.name} & {"p", "alpha", "restitution", *(["omega"] if by_size else [])}
    texts, sides = grid.case.texts, grid.case.block.sides
    if not varied:
        return grid.case.block_call
    slowest = min(side.p for side in sides)
    size = f"{_rate(grid)!r} / omega" if "omega" in varied else "p" if "p" in varied else ""
    arguments = {
        "p": _pair([f"{size} * {side.p / slowest!r}" if size else repr(side.p) for side in sides]),
        "alpha": "np.radians(alpha)" if "alpha" in varied else _pair([repr(side.alpha) for side in sides]),
    }
    if "restitution" in varied:
        arguments["restitution"] = "restitution"
    elif "alpha" not in varied or "restitution" in texts:
        arguments["restitution"] = _pair([repr(side.restitution) for side in sides])
    if "gravity" in texts:
        arguments["gravity"] = repr(grid.case.block.gravity)
    return f"Block.from_parameters({', '.join(f'{name}={value}' for name, value in arguments.items())})"


def _rate(grid: MapGrid) -> float:
    """Angular frequency of the pulse, rad/s."""
    return float(2.0 * math.pi * arguments_of(grid.case.texts["motion"])["frequency"])


def _in_seconds(grid: MapGrid) -> str:
    """Factor that brings times of blocks of another size to those under a pulse of another frequency."""
    if "omega" not in (grid.x.name, grid.y.name):
        return ""
    omega = "xs" if grid.x.name == "omega" else "ys[:, None]"
    return f" * ({_rate(grid)!r} / {omega} / {min(side.p for side in grid.case.block.sides)!r})"


def _pair(sides: list[str]) -> str:
    plain = [each.removesuffix(" * 1.0") for each in sides]
    return plain[0] if plain[0] == plain[1] else f"[{', '.join(plain)}]"


def _motion(grid: MapGrid) -> str:
    """Call that makes the motion, with the names of the axes among its arguments."""
    names, made = {grid.x.name, grid.y.name}, grid.case.motion_call
    text = grid.case.texts.get("motion", "")
    if "omega" in names and is_pulse(text):
        p = min(side.p for side in grid.case.block.sides)
        given = arguments_of(text)
        frequency = f"omega * {p!r} / (2.0 * math.pi)"
        written = {name: repr(value) for name, value in given.items()}
        written |= {"amplitude": repr(sign_of(grid.case.texts) * given["amplitude"]), "frequency": frequency}
        if "duration" in given:
            written["duration"] = f"{given['duration'] * given['frequency']!r} / ({frequency})"
        made = pulse_call(text, written)
    if "a" in names:
        return f"{made}.scaled_to(a * min(block.uplift_thresholds({grid.case.model!r})))"
    if "pga" in names:
        return f"{made}.scaled_to(pga * {STANDARD_GRAVITY!r})"
    return f"{made}.scaled_to({grid.motion.pga!r})" if "omega" in names else made
