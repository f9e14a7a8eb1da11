"""Laws of the public interface: what stands first, and what is called how."""

import ast
import functools
import inspect
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from public_names import callables, unreachable

import rocking

#: What rocks, and what shakes it, by the names of parameters.
ROCKS = {"block", "blocks", "body", "bodies"}
SHAKES = {"motion", "motions", "pulse"}

#: Words that are no longer used for what another word stands for.
OTHER_WORDS = {"t": "time", "scale": "levels", "pga": "measure", "pgv": "measure", "sa": "measure"}

#: What is built up step by step, within one call.
CHANGING = {"OrbitEquations"}

#: Most parameters of one function.
MOST = 13


def parameters_of(value: Any) -> dict[str, inspect.Parameter]:
    try:
        found = inspect.signature(value).parameters
    except ValueError:  # an enumeration
        return {}
    return {name: each for name, each in found.items() if name not in ("self", "cls")}


FUNCTIONS = {name: value for name, value in callables().items() if not inspect.isclass(value)}


def test_what_rocks_stands_first_and_what_shakes_it_second() -> None:
    judged = 0
    for name, function in FUNCTIONS.items():
        names = list(parameters_of(function))
        if ROCKS & {*names} and SHAKES & {*names} and not {"blocks", "block"} & {*names[2:]}:
            judged += 1
            first, second = [each for each in names if each in ROCKS | SHAKES][:2]
            assert first in ROCKS and second in SHAKES, name
    assert judged >= 10


def test_the_default_model_is_nonlinear() -> None:
    defaults = {name: each["model"].default for name, f in FUNCTIONS.items() if "model" in (each := parameters_of(f))}
    chosen = {name: model for name, model in defaults.items() if model not in (inspect.Parameter.empty, None)}
    assert len(chosen) >= 8
    assert set(chosen.values()) == {"nonlinear"}, chosen


def test_a_default_is_the_same_everywhere() -> None:
    """Of parameters that mean the same in all functions."""
    shared = ("polarity", "threads", "progress", "title", "figsize", "ax", "seed", "measure", "period")
    for name in shared:
        found = {
            function: each[name].default
            for function, value in FUNCTIONS.items()
            if name in (each := parameters_of(value)) and each[name].default is not inspect.Parameter.empty
        }
        # The period of a measure is a time; that of an orbit is a number of periods.
        several = name in ("measure", "period")
        assert len({repr(default) for default in found.values()}) <= 1 + several, (name, found)


def modules(words: str) -> Iterator[tuple[Path, ast.Module]]:
    """Modules of the package that have these words in them."""
    for path in sorted(Path(rocking.__file__).parent.rglob("*.py")):
        text = path.read_text("utf-8")
        if words in text:
            yield path, ast.parse(text)


def test_an_error_that_says_what_was_given_keeps_it() -> None:
    """A sentence that names an argument, and what it is "not", has this as its value."""
    judged = 0
    for path, tree in modules(", not"):
        said: dict[str, ast.expr] = {}  # sentences that have a name, in the order of the text
        for node in sorted(ast.walk(tree), key=lambda each: getattr(each, "lineno", 0)):
            if isinstance(node, ast.Assign) and isinstance(node.targets[0], ast.Name):
                said[node.targets[0].id] = node.value
            if not (isinstance(node, ast.Raise) and isinstance(node.exc, ast.Call) and node.exc.args):
                continue
            sentence, *arguments = node.exc.args
            if isinstance(sentence, ast.Name):
                sentence = said.get(sentence.id, sentence)
            if arguments and re.search(r"(?:, not|; got) \{(?!\{)", ast.unparse(sentence)):
                judged += 1
                # A literal dictionary of keywords may hold it, too.
                assert {each.arg for each in node.exc.keywords} & {"value", None}, f"{path}, line {node.lineno}"
    assert judged >= 65


def test_functions_take_few_parameters_in_plain_words() -> None:
    assert len(FUNCTIONS) > 280
    for name, function in FUNCTIONS.items():
        names = list(parameters_of(function))
        assert len(names) <= MOST, name
        assert not {*names} & {*OTHER_WORDS} - {name.rpartition(".")[2]}, name


@pytest.mark.parametrize("name", [name for name in FUNCTIONS if re.search(r"\.to_|\.export", name)])
def test_what_is_written_to_a_file_is_called_to_format(name: str) -> None:
    last = name.rpartition(".")[2]
    assert re.fullmatch(r"to_(csv|netcdf|parquet|nrml|json|excel|html|dict|dataframe|xarray)", last)
    names = list(parameters_of(FUNCTIONS[name]))
    if last not in ("to_dict", "to_dataframe", "to_xarray"):
        assert names[0] == "path"


@pytest.mark.parametrize("name", [name for name in FUNCTIONS if name.endswith(".plot")])
def test_every_figure_takes_axes_a_title_and_a_size(name: str) -> None:
    assert {"ax", "title", "figsize"} <= {*parameters_of(FUNCTIONS[name])}


@pytest.mark.thorough
def test_all_that_is_taken_or_returned_has_a_public_name() -> None:
    assert unreachable() == []


@functools.cache
def made_dataclasses() -> list[tuple[ast.ClassDef, str]]:
    """Every dataclass of the package, with its decorator."""
    return [
        (node, ast.unparse(made))
        for _, tree in modules("@dataclass")
        for node in ast.walk(tree)
        for made in (node.decorator_list if isinstance(node, ast.ClassDef) else [])
        if ast.unparse(made).startswith("dataclass")
    ]


@pytest.mark.thorough
def test_what_holds_data_cannot_be_changed() -> None:
    """All dataclasses are frozen but those that are built up within one call."""
    made = made_dataclasses()
    assert len(made) >= 100
    assert {node.name for node, how in made if "frozen=True" not in how} == CHANGING


@pytest.mark.thorough
def test_what_holds_arrays_is_equal_to_itself_alone_and_a_result_says_what_it_is() -> None:
    """Arrays cannot be compared by one truth value, nor hashed; a result's own text would be hidden by its fields."""
    arrays = re.compile(r"\b(Floats|Integers|Flags|NDArray|ndarray|Dataset|DataArray|DataFrame)\b")
    comparing, hiding, judged = set(), set(), 0
    for node, how in made_dataclasses():
        bases = [ast.unparse(base).rpartition(".")[2] for base in node.bases]
        is_result = any(base.endswith(("Result", "Response", "UnderRecords", "WrittenToFiles")) for base in bases)
        fields = [ast.unparse(field.annotation) for field in node.body if isinstance(field, ast.AnnAssign)]
        if is_result or any(map(arrays.search, fields)):
            judged += 1
            comparing |= {node.name} if "eq=False" not in how else set()
            hiding |= {node.name} if is_result and "repr=False" not in how else set()
    assert judged >= 50
    assert comparing == hiding == set()
