"""Messages on the command line: options in place of arguments, and the nearest name that may be meant."""

from __future__ import annotations

import functools
from collections.abc import Iterable, Sequence
from inspect import Parameter
from typing import Final

from cyclopts import App, Argument, CoercionError, CycloptsError, MissingArgumentError, UnknownCommandError
from cyclopts.exceptions import UnknownOptionError, UnusedCliTokensError

from rocking.checks import meant
from rocking.errors import DamagedStudy, InvalidOption, RockingError, Spelling
from rocking.inputs.texts import option_of

#: How alike two names must be for the one to be a slip of the other: a letter or two in a word of six.
_ALIKE: Final = 0.8

#: Names so short are too alike for a guess: a suggestion must not lead to another quantity.
_SHORT: Final = len("--pga")

#: What kinds of numbers are called.
_NUMBERS: Final[dict[type, str]] = {float: "a number", int: "a whole number"}


def spelling_of(command: App) -> Spelling:
    """Return how a command writes the name of an argument: as its option, if it has that option."""

    @functools.cache  # Nothing is asked of the command before a message names an argument.
    def options() -> frozenset[str]:
        return frozenset(_options(command))

    return lambda name: option_of(name) if option_of(name) in options() else name


def called(app: App, arguments: Sequence[str]) -> App:
    """Return the command that is called, or the program where none is; to the parser --help is a command as well."""
    return app.parse_commands(arguments)[1][len(_words(app, arguments))]


def refuse_unknown_options(given: Iterable[object], app: App, arguments: Sequence[str]) -> None:
    """Check that no name of a record is an option that the command does not have; after "--" any name may be one.

    Raises
    ------
    InvalidOption
        Naming that option, and the one that may be meant.
    """
    typed = arguments[: arguments.index("--")] if "--" in arguments else arguments
    for name in given:
        if isinstance(name, str) and name.startswith("-") and name.lstrip("-")[:1].isalpha() and name in typed:
            raise InvalidOption(_unknown_option(name, app, arguments))


def of(error: RockingError | CycloptsError, app: App, arguments: Sequence[str]) -> str:
    """Return an error as one line that names options."""
    if isinstance(error, DamagedStudy):
        return f"{error.text()}: rocking study verify FOLDER --repair computes it again"
    if isinstance(error, RockingError):
        return error.text(spelling_of(called(app, arguments))).rstrip(".")
    if isinstance(error, UnknownCommandError):
        unknown = (error.unused_tokens or arguments)[0]
        commands = [each for each in called(app, arguments) if not each.startswith("-")]
        hint = meant(unknown, commands, f"there are {', '.join(commands)}")
        return f"there is no command {unknown}; {hint}"
    if isinstance(error, UnknownOptionError):
        return _unknown_option(error.token.keyword or error.token.value, app, arguments)
    sentence = " ".join(str(error).split()).rstrip(".")
    command = _named(app, arguments)
    argument = error.argument
    if isinstance(error, MissingArgumentError) and argument is not None:
        is_given = any(each.partition("=")[0] in argument.names for each in arguments)
        sentence = f"{command} needs {_name(argument)}"
        if is_given and not _is_positional(argument):
            sentence = f"{_name(argument)} needs a value"
    elif isinstance(error, CoercionError) and argument and error.token and error.target_type in _NUMBERS:
        sentence = f"{_name(argument)} takes {_NUMBERS[error.target_type]}, not {error.token.value!r}"
    elif isinstance(error, UnusedCliTokensError):
        sentence = f"{command} takes no argument {' '.join(error.unused_tokens or ())!r}"
    return f"{sentence}; see {command} --help"


def _unknown_option(typed: str, app: App, arguments: Sequence[str]) -> str:
    name = typed.partition("=")[0]
    command = called(app, arguments)
    known = {"--help", *_options(command), *(each for each in command if each.startswith("-"))}
    words = {each.lstrip("-"): each for each in known if len(each) > _SHORT}
    hint = meant(name.lstrip("-"), words if len(name) > _SHORT else {}, "see its --help", _ALIKE)
    return f"{_named(app, arguments)} has no option {name}; {hint}"


def _named(app: App, arguments: Sequence[str]) -> str:
    """Return how the command that is called is typed."""
    return " ".join(["rocking", *_words(app, arguments)])


def _words(app: App, arguments: Sequence[str]) -> list[str]:
    return [each for each in app.parse_commands(arguments)[0] if each not in app.help_flags]


def _options(command: App) -> Iterable[str]:
    """Options of a command, without the arguments that need no name."""
    if command.default_command is None:
        return ()
    arguments = command.assemble_argument_collection()
    return [name for each in arguments if not _is_positional(each) for name in each.names if name.startswith("-")]


def _name(argument: Argument) -> str:
    return argument.name.lstrip("-").upper() if _is_positional(argument) else argument.name


def _is_positional(argument: Argument) -> bool:
    return not argument.keys and argument.field_info.kind is not Parameter.KEYWORD_ONLY
