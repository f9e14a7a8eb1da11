"""Command line: thin commands over the public names, in modules that are imported when they are called."""

from __future__ import annotations

import ast
import errno
import functools
import os
import sys
from collections.abc import Iterable, Sequence
from inspect import Parameter
from pathlib import Path

from cyclopts import App, Argument, CycloptsError, MissingArgumentError, UnknownCommandError

from rocking.core.checks import meant
from rocking.core.progress import notes_for
from rocking.errors import INTERRUPTED, DamagedStudy, InvalidOption, RockingError, Spelling
from rocking.inputs.texts import option_of

app = App(
    name="rocking",
    help="Rocking, chattering, rest and overturning of free-standing rigid blocks under ground motion.",
    version_flags=[],
    result_action="return_value",
)


def _lines_of(module: str) -> dict[str, str]:
    """Return the first line of what each function says of itself; nothing is imported for a list of commands."""
    parsed = ast.parse(Path(__file__).with_name(f"{module}.py").read_text("utf-8"))
    functions = [each for each in parsed.body if isinstance(each, ast.FunctionDef)]
    return {each.name: (ast.get_docstring(each) or "").partition("\n")[0] for each in functions}


for _module, _commands in {
    "simulate": ("simulate", "check", "records", "pulses"),
    "analysis": ("chatter", "critical", "spectrum", "map", "ida", "measures"),
    "fragility": ("fragility",),
    "calibrate": ("calibrate", "validate"),
    "mesh": ("mesh",),
    "explore": ("explore",),
}.items():
    _lines = _lines_of(_module)
    for _command in _commands:
        app.command(f"rocking.cli.{_module}:{_command}", name=_command, help=_lines[_command])
app.command(
    "rocking.cli.study:study",
    name="study",
    help="Run a study too long for one sitting: created once, resumed after anything.",
)


def _version(*, verbose: bool = False) -> None:
    """Display the version.

    Parameters
    ----------
    verbose
        Add the versions of Python and of the libraries below, and which compiled code serves this installation.
    """
    import platform
    from importlib import metadata

    import rocking
    from rocking.kernels import compiled

    if not verbose:
        print(rocking.__version__)
        return
    below = ", ".join(f"{name} {metadata.version(name)}" for name in ("numpy", "scipy"))
    rows = {
        "rocking": rocking.__version__,
        "Python": f"{platform.python_version()} on {platform.platform()}",
        "packages": below,
        "compiled code": compiled.state(),
    }
    for name, value in rows.items():
        print(f"{name:13}  {value}")


app.command(_version, name=["--version", "-V"], help="Display the version.")
app.register_install_completion_command(help="Install completion of commands and options for this shell.")


def main(arguments: Sequence[str] | None = None) -> None:
    """Run the command line and exit: 0 when done, 2 with one line on stderr for bad input, 130 when interrupted."""
    # Figures are written to files here, so no toolkit of windows need be started for them.
    os.environ.setdefault("MPLBACKEND", "agg")
    for stream in (sys.stdout, sys.stderr):
        if hasattr(stream, "reconfigure"):
            stream.reconfigure(errors="replace")  # what the locale cannot encode is shown as question marks
    given = list(sys.argv[1:] if arguments is None else arguments)
    try:
        _run(given)
        return
    except KeyboardInterrupt:
        pass
    except BrokenPipeError:
        # The reader of our output has gone; so must Python's own last flush.
        _close_output()
        return
    except Exception as error:
        if not _is_of_an_interrupt(error):
            sentence = _sentence(error, given)
            if not sentence:
                raise
            print(f"rocking: {sentence}", file=sys.stderr)
            sys.exit(2)
    # Not within `except`: its traceback would keep the iterators whose threads end when they are closed.
    print(INTERRUPTED, file=sys.stderr)
    sys.exit(130)


def _is_of_an_interrupt(error: BaseException | None) -> bool:
    """Whether an error was raised in place of an interrupt, as by a lock of `threading` within which that fell."""
    while error is not None and not isinstance(error, KeyboardInterrupt):
        error = error.__context__
    return error is not None


def _sentence(error: Exception, given: list[str]) -> str:
    """Return an error as one line that names options; nothing where it is a fault of the program."""
    if isinstance(error, DamagedStudy):
        return f"{error.text()}: rocking study verify FOLDER --repair computes it again"
    if isinstance(error, RockingError):
        return error.text(spelling_of(command_of(given))).rstrip(".")
    if isinstance(error, UnknownCommandError):
        unknown, commands = (error.unused_tokens or given)[0], [*filter(str.isalpha, command_of(given))]
        hint = meant(unknown, commands, f"there are {', '.join(commands)}")
        return f"there is no command {unknown}; {hint}"
    if isinstance(error, MissingArgumentError) and (missing := error.argument) is not None:
        is_given = any(each.partition("=")[0] in missing.names for each in given)
        wants = f"{missing.name} needs a value" if is_given else f"{_named(given)} needs {_name(missing)}"
        return f"{wants}; see {_named(given)} --help"
    if isinstance(error, CycloptsError):
        sentence = " ".join(str(error).split()).rstrip(".")
        return sentence if sentence.endswith("?") else f"{sentence}; see {_named(given)} --help"
    if isinstance(error, OSError) and error.errno in (errno.ENOSPC, errno.EDQUOT, errno.EFBIG, errno.EIO):
        # Files have their own sentence: this is what is printed, to a disk that is full.
        _close_output()
        return f"the output cannot be written: {os.strerror(error.errno)}; send it elsewhere"
    if isinstance(error, OSError) and error.filename is not None:
        return f"{error.filename}: {error.strerror}; name another place"
    return ""


def _run(given: list[str]) -> None:
    """Call the command that is given."""
    called = command_of(given)
    if called.default_command is not None:
        called.help = None  # The help of a command is all that its function says, not its line in the list.
    command, bound, _ = app.parse_args(given, exit_on_error=False, print_error=False)
    refuse_unknown_options(bound.args, given)
    quiet = any(getattr(value, "quiet", False) for value in bound.arguments.values())
    with notes_for("nobody" if quiet else "everybody", spelling_of(called)):
        command(*bound.args, **bound.kwargs)
    sys.stdout.flush()


def _close_output() -> None:
    """Send to nowhere what is still to be printed."""
    os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())


def spelling_of(command: App) -> Spelling:
    """Return how a command writes the name of an argument: as its option, if it has that option."""

    @functools.cache  # Nothing is asked of the command before a message names an argument.
    def options() -> frozenset[str]:
        return frozenset(_options(command))

    return lambda name: option_of(name) if option_of(name) in options() else name


def command_of(arguments: Sequence[str]) -> App:
    """Return the command that is called, or the program where none is; to the parser --help is a command as well."""
    return app.parse_commands(arguments)[1][len(_words(arguments))]


def refuse_unknown_options(given: Iterable[object], arguments: Sequence[str]) -> None:
    """Check that no name of a record is an option that the command does not have; after "--" any name may be one."""
    typed = arguments[: arguments.index("--")] if "--" in arguments else arguments
    for name in given:
        if isinstance(name, str) and name.startswith("-") and name.lstrip("-")[:1].isalpha() and name in typed:
            option = name.partition("=")[0]
            # Short names are too alike for a guess: a suggestion must not lead to another quantity.
            known = [each for each in _options(command_of(arguments)) if min(len(each), len(option)) > len("--pga")]
            words = {each.lstrip("-"): each for each in known}
            hint = meant(option.lstrip("-"), words, "see its --help", 0.8)  # a slip: a letter or two of six
            raise InvalidOption(f"{_named(arguments)} has no option {option}; {hint}")


def _named(arguments: Sequence[str]) -> str:
    """Return how the command that is called is typed."""
    return " ".join(["rocking", *_words(arguments)])


def _words(arguments: Sequence[str]) -> list[str]:
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
