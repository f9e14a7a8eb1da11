"""Messages in the words of the command line: options in place of arguments, and the nearest name that is meant."""

from __future__ import annotations

import difflib
import re
from collections.abc import Iterable, Sequence
from typing import Final

from cyclopts import App, CycloptsError, UnknownCommandError

from rocking.errors import InvalidOption

#: How alike two names must be for the one to be a slip of the other: a letter or two in a word of six.
_ALIKE: Final = 0.8

#: Names so short are too alike for a guess: a suggestion must not lead to another quantity.
_SHORT: Final = len("--pga")

_OPTION: Final = re.compile(r"--?[A-Za-z]")


def of(error: Exception, app: App, arguments: Sequence[str]) -> str:
    """Return an error as one line that names options."""
    sentence = " ".join(str(error).split()).rstrip(".")
    if isinstance(error, UnknownCommandError):
        return _unknown_command(_called(app, arguments), (error.unused_tokens or arguments)[0])
    if isinstance(error, CycloptsError):
        return f"{sentence}; see rocking{''.join(f' {name}' for name in _command(app, arguments))} --help"
    return _with_options(sentence, _options(app, arguments))


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


def _called(app: App, arguments: Sequence[str]) -> App:
    for name in _command(app, arguments):
        app = app[name]
    return app


def _options(app: App, arguments: Sequence[str]) -> set[str]:
    """Return the options of the command that is called."""
    called = _called(app, arguments)
    if called.default_command is None:
        return {"--help", "-h", "--version", "-V"}
    collection = called.assemble_argument_collection()
    own = {name for argument in collection for name in argument.names if name.startswith("-")}
    return own | {"--help", "-h", "--version", "-V"}


def _with_options(sentence: str, options: set[str]) -> str:
    """Name options where a message names the arguments that they stand for."""
    for option in sorted(options, key=len, reverse=True):
        name = option.removeprefix("--").replace("-", "_")
        if len(name) > 1 or name == "p":
            sentence = re.sub(rf"(?<![\w./\\'\"-]){name} ?= ?(?=\s|[\w'\"]|$)", f"{option} ", sentence)
            sentence = re.sub(rf"\bleave {name} out\b", f"leave {option} out", sentence)
        if "_" in name:
            sentence = re.sub(rf"(?<![\w./\\'\"-]){name}(?![\w./\\'\"-])", option, sentence)
    return re.sub(r" +", " ", sentence)
