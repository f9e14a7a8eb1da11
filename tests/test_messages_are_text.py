"""Messages are for people alone: with nonsense in place of every one of them nothing but the text changes."""

import json
from contextlib import contextmanager

import numpy as np
import pytest

import rocking
from rocking import Block, Motion, checks
from rocking.analysis.survey import survey
from rocking.cli import wording
from rocking.errors import InvalidBlock, InvalidOption, Message, RockingError, literal
from rocking.explorer.uploads import UploadStore
from rocking.named_pulses import named_pulse

RECORD = "el-centro-meloland-270"
SIZES = ["--width", "0.24", "--height", "1.1"]
NONSENSE = "xyz"


@contextmanager
def nonsense():
    """Let every message be the same word."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(Message, "text", lambda *_: NONSENSE)
        for each in all_errors():
            for name in {"text", "__str__"} & {*vars(each)}:
                patch.setattr(each, name, lambda *_: NONSENSE)
        yield


def all_errors(base=RockingError):
    """Return the package's errors."""
    return [base, *(each for one in base.__subclasses__() for each in all_errors(one))]


def refusal(call):
    """Return what an error says as data: what it is, and what it is about."""
    with pytest.raises(RockingError) as caught:
        call()
    error = caught.value
    return {
        "type": type(error),
        "argument": error.argument,
        "arguments": error.message.arguments,
        "path": error.path,
        "line": error.line,
        "value": error.value,
        "text": str(error),
    }


def without_text(found):
    """Leave out of something nested what are sentences, and nothing else: the reason why a file was left out."""
    if isinstance(found, dict):
        kept = {name: without_text(value) for name, value in found.items() if name not in ("error", "text")}
        return kept | {"skipped": [*kept["skipped"]]} if isinstance(kept.get("skipped"), dict) else kept
    return [without_text(each) for each in found] if isinstance(found, list) else found


@pytest.fixture
def folder(tmp_path):
    """Record files: one that is sound, and one for each way to be wrong."""
    (tmp_path / "sound.csv").write_text(
        "time (s),a (g)\n" + "".join(f"{0.01 * k},{0.1 * k % 0.4}\n" for k in range(50))
    )
    (tmp_path / "no-units.txt").write_text("0 1\n1 2\n2 1\n")
    (tmp_path / "no-step.txt").write_text("# cm/s2\n0.1\n0.3\n-0.2\n")
    (tmp_path / "damaged.csv").write_text("time (s),a (g)\n0,0\n0.01,oops\n0.02,0.1\n")
    (tmp_path / "two.csv").write_text("time (s),NS (g),EW (g)\n0,0,0\n0.01,0.1,0.2\n0.02,0.1,0.1\n")
    return tmp_path


#: Calls of the library that are refused, by what they do; each takes the folder of record files.
REFUSED = {
    "size below zero": lambda _: Block(half_width=-0.2, half_height=1.0),
    "half a pair of sizes": lambda _: Block(half_width=0.2),
    "block too stocky": lambda _: Block(half_width=1.0, half_height=0.5),
    "three sides": lambda _: Block.from_parameters((1.0, 2.0, 3.0), 0.2),
    "degrees": lambda _: Block.from_parameters(2.0, 12.0),
    "offset too large": lambda _: Block(width=0.3, height=1.0, offset=0.2),
    "step below zero": lambda _: Motion.from_samples([0.0, 1.0], -0.01),
    "period without sa": lambda _: rocking.Measure("pga", period=1.0),
    "unknown treatment": lambda _: rocking.simulate(Block(width=0.2, height=1.0), None, chattering="hope"),
    "treatment out of range": lambda _: rocking.simulate(
        Block(width=0.2, height=1.0), None, initial_rotation=0.1, chattering="certified=0"
    ),
    "rotation beyond a quarter turn": lambda _: rocking.simulate(
        Block(width=0.2, height=1.0), None, initial_rotation=12.0
    ),
    "friction as an angle": lambda _: survey(
        Block(width=0.2, height=1.0), [rocking.pulses.one_sine(1.0, 1.0)], friction=30.0
    ),
    "unknown rule": lambda _: rocking.rules.rate(
        Block(width=0.2, height=1.0), rocking.pulses.one_sine(1.0, 1.0), ["wst"]
    ),
    "pulse without a parameter": lambda _: named_pulse("sine:amplitude=0.2g"),
    "file without units": lambda folder: rocking.read(folder / "no-units.txt"),
    "file without a step": lambda folder: rocking.read(folder / "no-step.txt"),
    "damaged file": lambda folder: rocking.read(folder / "damaged.csv"),
    "file of two channels": lambda folder: rocking.read(folder / "two.csv"),
    "channel that is not there": lambda folder: rocking.read(folder / "two.csv", channel="UP"),
    "file that is not there": lambda folder: rocking.read(folder / "nothing.AT2"),
    "step that is not the file's": lambda folder: rocking.read(folder / "sound.csv", dt=0.02),
}


@pytest.mark.parametrize("call", REFUSED.values(), ids=REFUSED)
def test_what_an_error_is_about_does_not_hang_on_its_words(call, folder):
    plain = refusal(lambda: call(folder))
    with nonsense():
        other = refusal(lambda: call(folder))
    assert (other.pop("text"), plain.pop("text") == NONSENSE) == (NONSENSE, False)
    assert other == plain


#: What names an argument in its words keeps it as data.
NAMED = {
    "size below zero": "half_width",
    "treatment out of range": "chattering",
    "unknown rule": "rules",
    "file without units": "units",
    "file without a step": "dt",
    "file of two channels": "channel",
    "step that is not the file's": "dt",
}


@pytest.mark.parametrize(("what", "argument"), NAMED.items())
def test_an_error_names_its_argument_as_data(what, argument, folder):
    found = refusal(lambda: REFUSED[what](folder))
    assert found["argument"] == argument
    # A record's error says in which file it is.
    assert (found["path"] is not None) == ("file" in what)


#: Commands, with FOLDER and OUT for the files that they read and write; with what they name as data where they fail.
COMMANDS = {
    f"simulate {RECORD} --json --out OUT": None,
    f"simulate {RECORD} FOLDER --keep-going --json --out OUT": None,
    "records FOLDER --json": None,
    f"check {RECORD} --rules west,ishiyama --json --out OUT": None,
    f"ida {RECORD} --levels 1:2:3 --json": None,
    f"simulate {RECORD} --p 3.33,3.34 --alpha 0.322,0.245 --json": None,
    f"simulate {RECORD} --width -1 --height 1": "width",
    f"simulate {RECORD} --p 0 --alpha 0.2": "p",
    f"simulate {RECORD} --width 1": "width",
    f"simulate {RECORD} --width 1 --half-width 1": "width",
    f"simulate {RECORD} --chattering certified=0": "chattering",
    f"simulate {RECORD} --initial-rotation 95deg": "initial_rotation",
    f"simulate {RECORD} --channel 7": "channel",
    f"simulate {RECORD} --friction 30": "friction",
    f"simulate {RECORD} --each": "each",
    "simulate FOLDER/no-units.txt": "units",
    "simulate FOLDER/no-step.txt": "dt",
    f"ida {RECORD} --measure pgv --levels 0.2g:1g:5": "levels",
    f"check {RECORD} --rules wst": "rules",
    f"simulate {RECORD} --widht 3": None,
    "nothing": None,
}


def outcome(run, command, folder, out):
    """Return what a command does, as data: how it ends, what it prints as JSON, its files, and what an error names."""
    errors = []
    described = wording.of
    sizes = [] if "--width" in command or "--p" in command or command.startswith(("records", "nothing")) else SIZES
    typed = [word.replace("FOLDER", str(folder)).replace("OUT", str(out)) for word in command.split()]
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(wording, "of", lambda error, *given: errors.append(error) or described(error, *given))
        code, printed, err = run(*typed, *sizes)
    files = {}
    for path in sorted(out.iterdir()) if out.is_dir() else ():
        # Figures hold the time at which they were drawn, summary.csv why records were left out.
        files[path.name] = path.read_bytes() if path.suffix == ".csv" and path.name != "summary.csv" else None
        if path.suffix == ".json":
            files[path.name] = without_text(json.loads(path.read_text("utf-8")))
    named = [getattr(error, "argument", None) for error in errors]
    shown = without_text(json.loads(printed)) if printed else None
    return {"code": code, "printed": shown, "files": files, "named": named, "notes": bool(err)}, err


@pytest.mark.thorough
@pytest.mark.parametrize(("command", "argument"), COMMANDS.items(), ids=COMMANDS)
def test_what_a_command_does_does_not_hang_on_its_words(run, folder, tmp_path_factory, command, argument):
    plain, said = outcome(run, command, folder, tmp_path_factory.mktemp("plain") / "out")
    with nonsense():
        other, nothing = outcome(run, command, folder, tmp_path_factory.mktemp("other") / "out")
    if argument is not None:
        assert (plain["code"], plain["named"], plain["printed"]) == (2, [argument], None)
        assert NONSENSE in nothing and NONSENSE not in said
    assert [str(each) for each in plain.pop("named")] == [str(each) if each else "None" for each in other.pop("named")]
    assert other == plain


def test_what_the_explorer_asks_of_a_file_does_not_hang_on_words(folder):
    """The fields of an upload that a page shows; other requests of a page belong here as well."""

    def described(name):
        uploads = UploadStore()
        found = uploads.contents(uploads.add_file(name, (folder / name).read_bytes()))
        return {field: found[field] for field in ("name", "format", "missing")}

    for name, missing in (("no-units.txt", ["units"]), ("no-step.txt", ["dt"]), ("sound.csv", [])):
        plain = described(name)
        assert plain["missing"] == missing
        with nonsense():
            assert described(name) == plain


def test_a_survey_of_motions_without_names_is_that_of_their_own_names():
    block, pulse = Block(width=0.24, height=1.1), rocking.pulses.one_sine(3.0, 1.0)
    by_order, by_name = survey(block, [pulse]), survey(block, {pulse.name: pulse})
    assert by_order.rows() == by_name.rows()
    checked = rocking.rules.check(block, [pulse, pulse], rules=["west"])
    assert len(set(checked.records)) == 2
    np.testing.assert_array_equal(checked.margins[0], checked.margins[1])
    assert [*checked.to_dataframe()["west"]] == [ratios["west"] for ratios in checked.ratios]


def test_braces_in_a_value_are_no_place_of_a_name():
    error = InvalidOption(f"{literal('a{}b')} and {checks.shown('{}')} need {{}}, not {{}}", "dt")
    assert error.text(lambda name: f"--{name}") == "a{}b and '{}' need --dt, not {}"
    with pytest.raises(InvalidBlock, match=r"not as '\{\}': width and height for the full sizes"):
        Block("{}")


def test_a_sentence_shows_both_ends_of_a_long_word():
    error = InvalidOption("{} takes a number, not " + "9" * 3000 + "x", "dt", value="9" * 3000 + "x")
    assert str(error) == "dt takes a number, not " + "9" * 200 + "..." + "9" * 199 + "x"
    assert len(error.value) == 3001
