"""Command line: thin wrappers of the public functions, imported when called."""

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

from rocking.core.checks import suggest
from rocking.core.progress import notes_for
from rocking.errors import INTERRUPTED, DamagedStudy, InvalidOption, RockingError, Spelling
from rocking.inputs.texts import write_option_name

app = App(
    name="rocking",
    help="Rocking, chattering, rest and overturning of free-standing rigid blocks under ground motion.",
    version_flags=[],
    result_action="return_value",
)


def _lines_of(module: str) -> dict[str, str]:
    """Return the first docstring line of each function, without importing the module."""
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
        Also list the versions of Python and of the required libraries, and the compiled code in use.
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
        "compiled code": compiled.describe_mode(),
    }
    for name, value in rows.items():
        print(f"{name:13}  {value}")


app.command(_version, name=["--version", "-V"], help="Display the version.")
app.register_install_completion_command(help="Install completion of commands and options for this shell.")


def main(arguments: Sequence[str] | None = None) -> None:
    """Run the command line and exit: 0 on success, 2 with one line on stderr for bad input, 130 if interrupted."""
    # Figures are only written to files, so no GUI toolkit is needed.
    os.environ.setdefault("MPLBACKEND", "agg")
    for stream in (sys.stdout, sys.stderr):
        if hasattr(stream, "reconfigure"):
            stream.reconfigure(errors="replace")  # characters outside the locale become question marks
    given = list(sys.argv[1:] if arguments is None else arguments)
    try:
        _run(given)
        return
    except KeyboardInterrupt:
        pass
    except BrokenPipeError:
        # The reader of the output has gone, so Python's final flush must not write either.
        _close_output()
        return
    except Exception as error:
        if not _is_of_an_interrupt(error):
            sentence = _sentence(error, given)
            if not sentence:
                raise
            print(f"rocking: {sentence}", file=sys.stderr)
            sys.exit(2)
    # Outside `except`: the traceback would keep alive iterators that own threads.
    print(INTERRUPTED, file=sys.stderr)
    sys.exit(130)


def _is_of_an_interrupt(error: BaseException | None) -> bool:
    """Whether an error replaced an interrupt, as in a lock of `threading`."""
    while error is not None and not isinstance(error, KeyboardInterrupt):
        error = error.__context__
    return error is not None


def _sentence(error: Exception, given: list[str]) -> str:
    """Return an error as one line that names options; empty for a bug of the program."""
    if isinstance(error, DamagedStudy):
        return f"{error.text()}: rocking study verify FOLDER --repair computes it again"
    if isinstance(error, RockingError):
        return error.text(spelling_of(command_of(given))).rstrip(".")
    if isinstance(error, UnknownCommandError):
        unknown, commands = (error.unused_tokens or given)[0], [*filter(str.isalpha, command_of(given))]
        hint = suggest(unknown, commands, f"there are {', '.join(commands)}")
        return f"there is no command {unknown}; {hint}"
    if isinstance(error, MissingArgumentError) and (missing := error.argument) is not None:
        is_given = any(each.partition("=")[0] in missing.names for each in given)
        wants = f"{missing.name} needs a value" if is_given else f"{_named(given)} needs {_name(missing)}"
        return f"{wants}; see {_named(given)} --help"
    if isinstance(error, CycloptsError):
        sentence = " ".join(str(error).split()).rstrip(".")
        return sentence if sentence.endswith("?") else f"{sentence}; see {_named(given)} --help"
    if isinstance(error, OSError) and error.errno in (errno.ENOSPC, errno.EDQUOT, errno.EFBIG, errno.EIO):
        # File errors have their own sentence; this is printing to a full disk.
        _close_output()
        return f"the output cannot be written: {os.strerror(error.errno)}; send it elsewhere"
    if isinstance(error, OSError) and error.filename is not None:
        return f"{error.filename}: {error.strerror}; name another place"
    return ""


def _run(given: list[str]) -> None:
    """Run the command in the arguments."""
    called = command_of(given)
    if called.default_command is not None:
        called.help = None  # The help of a command is its whole docstring, not its line in the list.
    command, bound, _ = app.parse_args(given, exit_on_error=False, print_error=False)
    refuse_unknown_options(bound.args, given)
    quiet = any(getattr(value, "quiet", False) for value in bound.arguments.values())
    with notes_for("nobody" if quiet else "everybody", spelling_of(called)):
        command(*bound.args, **bound.kwargs)
    sys.stdout.flush()


def _close_output() -> None:
    """Discard all remaining output."""
    os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())


def spelling_of(command: App) -> Spelling:
    """Return a function that spells an argument as the command's option, if there is one."""

    @functools.cache  # The command is inspected only when a message names an argument.
    def options() -> frozenset[str]:
        return frozenset(_options(command))

    return lambda name: write_option_name(name) if write_option_name(name) in options() else name


def command_of(arguments: Sequence[str]) -> App:
    """Return the called command, or the program if there is none. The parser treats --help as a command."""
    return app.parse_commands(arguments)[1][len(_words(arguments))]


def refuse_unknown_options(given: Iterable[object], arguments: Sequence[str]) -> None:
    """Check that no record name is an unknown option. After "--" any name is allowed."""
    typed = arguments[: arguments.index("--")] if "--" in arguments else arguments
    for name in given:
        if isinstance(name, str) and name.startswith("-") and name.lstrip("-")[:1].isalpha() and name in typed:
            option = name.partition("=")[0]
            # Short names are too alike to guess: a suggestion must not lead to another quantity.
            known = [each for each in _options(command_of(arguments)) if min(len(each), len(option)) > len("--pga")]
            words = {each.lstrip("-"): each for each in known}
            hint = suggest(option.lstrip("-"), words, "see its --help", 0.8)  # a typo of one or two letters in six
            raise InvalidOption(f"{_named(arguments)} has no option {option}; {hint}")


def _named(arguments: Sequence[str]) -> str:
    """Return the called command as it is typed."""
    return " ".join(["rocking", *_words(arguments)])


def _words(arguments: Sequence[str]) -> list[str]:
    return [each for each in app.parse_commands(arguments)[0] if each not in app.help_flags]


def _options(command: App) -> Iterable[str]:
    """Return the options of a command without its positional arguments."""
    if command.default_command is None:
        return ()
    arguments = command.assemble_argument_collection()
    return [name for each in arguments if not _is_positional(each) for name in each.names if name.startswith("-")]


def _name(argument: Argument) -> str:
    return argument.name.lstrip("-").upper() if _is_positional(argument) else argument.name


def _is_positional(argument: Argument) -> bool:
    return not argument.keys and argument.field_info.kind is not Parameter.KEYWORD_ONLY
