"""Messages in the words of the command line: options in place of arguments, and the nearest name that is meant."""

from __future__ import annotations

import difflib
import re
from collections.abc import Iterable, Sequence, Set
from inspect import Parameter
from typing import Final

from cyclopts import App, Argument, CoercionError, CycloptsError, MissingArgumentError, UnknownCommandError

from rocking.errors import DamagedStudy, InvalidOption, RockingError, Spelling

#: How alike two names must be for the one to be a slip of the other: a letter or two in a word of six.
_ALIKE: Final = 0.8

#: Names so short are too alike for a guess: a suggestion must not lead to another quantity.
_SHORT: Final = len("--pga")

#: What kinds of numbers are called.
_NUMBERS: Final[dict[type, str]] = {float: "a number", int: "a whole number"}

_OPTION: Final = re.compile(r"--?[A-Za-z]")


def of(error: Exception, app: App, arguments: Sequence[str]) -> str:
    """Return an error as one line that names options."""
    text = error.text(_spelling(app, arguments)) if isinstance(error, RockingError) else str(error)
    sentence = " ".join(text.split()).rstrip(".")
    if isinstance(error, UnknownCommandError):
        return _unknown_command(called(app, arguments), (error.unused_tokens or arguments)[0])
    command = f"rocking{''.join(f' {name}' for name in _command(app, arguments))}"
    if isinstance(error, MissingArgumentError) and error.argument is not None:
        return f"{_missing(error.argument, command, arguments)}; see {command} --help"
    if isinstance(error, CoercionError) and error.argument and error.token and error.target_type in _NUMBERS:
        return f"{_misread(error.argument, error.token.value, error.target_type)}; see {command} --help"
    if isinstance(error, CycloptsError):
        return f"{sentence}; see {command} --help"
    if isinstance(error, DamagedStudy):
        return f"{error.text()}: rocking study verify FOLDER --repair computes it again"
    return in_options(sentence, app, arguments)


def _spelling(app: App, arguments: Sequence[str]) -> Spelling:
    """Return how to write the name of an argument: as its option, if the command has it."""
    known = _options(app, arguments)
    return lambda name: option if (option := f"--{name.replace('_', '-')}") in known else name


def in_options(sentence: str, app: App, arguments: Sequence[str]) -> str:
    """Return a sentence with options in place of the arguments that they stand for."""
    return with_options(sentence, _options(app, arguments), _keywords(app, arguments))


def refuse_unknown_options(app: App, arguments: Sequence[str]) -> None:
    """Check that a command has the options that it is given.

    Raises
    ------
    InvalidOption
        Naming the one that it does not have, and the one that may be meant.
    """
    command = _command(app, arguments)
    if not command:
        return
    known = _options(app, arguments)
    for argument in arguments[len(command) :]:
        name = argument.partition("=")[0]
        if argument == "--":
            return
        if _OPTION.match(argument) and name not in known:
            raise InvalidOption(f"rocking {' '.join(command)} has no option {name}{_meant(name, known)}")


def called(app: App, arguments: Sequence[str]) -> App:
    """Return the command that is called, or the program where none is."""
    for name in _command(app, arguments):
        app = app[name]
    return app


def _unknown_command(app: App, name: str) -> str:
    commands = [each for each in app if not each.startswith("-")]
    close = difflib.get_close_matches(name, commands, n=1)
    hint = f"did you mean {close[0]}?" if close else f"there are {', '.join(commands)}"
    return f"there is no command {name}; {hint}"


def _meant(name: str, known: Iterable[str]) -> str:
    words = {each.lstrip("-"): each for each in known if len(each) > _SHORT}
    close = difflib.get_close_matches(name.lstrip("-"), words, n=1, cutoff=_ALIKE) if len(name) > _SHORT else []
    return f"; did you mean {words[close[0]]}?" if close else "; see its --help"


def _command(app: App, arguments: Sequence[str]) -> list[str]:
    """Names of the command that is called, and of its own command where it has several."""
    names, here = [], app
    for name in arguments:
        if name.startswith("-") or name not in list(here):
            break
        names.append(name)
        here = here[name]
    return names


def _missing(argument: Argument, command: str, arguments: Sequence[str]) -> str:
    """Say what a command needs, or that an option is given without its value."""
    if _is_positional(argument):
        return f"{command} needs {argument.name.lstrip('-').upper()}"
    given = any(each.partition("=")[0] in argument.names for each in arguments)
    return f"{argument.name} needs a value" if given else f"{command} needs {argument.name}"


def _misread(argument: Argument, text: str, wanted: type) -> str:
    """Say that an option takes a number, where its text is none."""
    name = argument.name.lstrip("-").upper() if _is_positional(argument) else argument.name
    return f"{name} takes {_NUMBERS[wanted]}, not {text!r}"


def _is_positional(argument: Argument) -> bool:
    return not argument.keys and argument.field_info.kind is not Parameter.KEYWORD_ONLY


def _options(app: App, arguments: Sequence[str]) -> set[str]:
    """Return the options of the command that is called."""
    chosen = called(app, arguments)
    if chosen.default_command is None:
        return {"--help", "-h", "--version", "-V"}
    return _names(chosen.assemble_argument_collection()) | {"--help", "-h", "--version", "-V"}


def _keywords(app: App, arguments: Sequence[str]) -> set[str]:
    """Return the options of the command that is called which are no positional arguments as well."""
    chosen = called(app, arguments)
    if chosen.default_command is None:
        return set()
    return _names(each for each in chosen.assemble_argument_collection() if not _is_positional(each))


def _names(collection: Iterable[Argument]) -> set[str]:
    return {name for argument in collection for name in argument.names if name.startswith("-")}


def with_options(sentence: str, options: Set[str], keywords: Set[str]) -> str:
    """Name options where a message names the arguments that they stand for; `keywords` are no positional ones."""
    for option in sorted(options, key=len, reverse=True):
        name = option.removeprefix("--").replace("-", "_")
        if len(name) > 1 or name == "p":
            sentence = re.sub(rf"(?<![\w./\\'\"-]){name} ?= ?(['\"])(\w+)\1", rf"{option} \2", sentence)
            sentence = re.sub(rf"(?<![\w./\\'\"-]){name} ?= ?(?=\s|[\w'\"]|$)", f"{option} ", sentence)
            sentence = re.sub(rf"\bleave {name} out\b", f"leave {option} out", sentence)
        if option in keywords:
            sentence = re.sub(rf"(?:^|(?<=: )){name}(?= must )", option, sentence)
        if "_" in name:
            sentence = re.sub(rf"(?<![\w./\\'\"-]){name}(?![\w./\\'\"-])", option, sentence)
    return re.sub(r" +", " ", sentence).rstrip()
