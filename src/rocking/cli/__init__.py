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
from rocking.errors import INTERRUPT_MESSAGE, DamagedStudyError, OptionError, RockingError, Spelling
from rocking.inputs.texts import format_option_name

app = App(
    name="rocking",
    help="Rocking, chattering, rest and overturning of free-standing rigid blocks under ground motion.",
    version_flags=[],
    result_action="return_value",
)


def _read_help_lines(module: str) -> dict[str, str]:
    """Read the first docstring line of each function, without importing the module."""
    tree = ast.parse(Path(__file__).with_name(f"{module}.py").read_text("utf-8"))
    functions = [node for node in tree.body if isinstance(node, ast.FunctionDef)]
    return {node.name: (ast.get_docstring(node) or "").partition("\n")[0] for node in functions}


for _module, _commands in {
    "simulate": ("simulate", "check", "records", "pulses"),
    "analysis": ("chatter", "critical", "spectrum", "map", "ida", "measures"),
    "fragility": ("fragility",),
    "assess": ("assess",),
    "calibrate": ("calibrate", "validate"),
    "mesh": ("mesh",),
    "explore": ("explore",),
    "page": ("page",),
}.items():
    _lines = _read_help_lines(_module)
    for _command in _commands:
        app.command(f"rocking.cli.{_module}:{_command}", name=_command, help=_lines[_command])
_study_help = "Run many simulations in a study, which can be interrupted and resumed."
app.command("rocking.cli.study:app", name="study", help=_study_help)


def _print_version(*, verbose: bool = False) -> None:
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
    versions = ", ".join(f"{name} {metadata.version(name)}" for name in ("numpy", "scipy"))
    print(f"rocking        {rocking.__version__}")
    print(f"Python         {platform.python_version()} on {platform.platform()}")
    print(f"packages       {versions}\ncompiled code  {compiled.describe_mode()}")


app.command(_print_version, name=["--version", "-V"], help="Display the version.")
app.register_install_completion_command(help="Install completion of commands and options for this shell.")


def main(arguments: Sequence[str] | None = None) -> None:
    """Run the command line and exit: 0 on success, 2 with one line on stderr for bad input, 130 if interrupted."""
    # Figures are only written to files, so no GUI toolkit is needed.
    os.environ.setdefault("MPLBACKEND", "agg")
    for stream in (sys.stdout, sys.stderr):
        if hasattr(stream, "reconfigure"):
            stream.reconfigure(errors="replace")  # characters outside the locale become question marks
    words = list(sys.argv[1:] if arguments is None else arguments)
    try:
        _run_command(words)
        return
    except KeyboardInterrupt:
        pass
    except BrokenPipeError:
        # The reader of the output has gone, so Python's final flush must not write either.
        _close_output()
        return
    except Exception as error:
        if not _is_interrupt(error):
            message = _format_error(error, words)
            if not message:
                raise
            print(f"rocking: {message}", file=sys.stderr)
            sys.exit(2)
    # Outside `except`: the traceback would keep alive iterators that own threads.
    print(INTERRUPT_MESSAGE, file=sys.stderr)
    sys.exit(130)


def _is_interrupt(error: BaseException | None) -> bool:
    """Return whether an interrupt caused an error, as in a lock of `threading`."""
    while error is not None and not isinstance(error, KeyboardInterrupt):
        error = error.__context__
    return error is not None


def _format_error(error: Exception, words: list[str]) -> str:
    """Format an error as one line with option names; empty for an unexpected exception."""
    if isinstance(error, DamagedStudyError):
        return f"{error.text()}: rocking study verify FOLDER --repair computes it again"
    if isinstance(error, RockingError):
        return error.text(create_spelling(find_command(words))).rstrip(".")
    if isinstance(error, UnknownCommandError):
        unknown, commands = (error.unused_tokens or words)[0], [*filter(str.isalpha, find_command(words))]
        return f"there is no command {unknown}; {suggest(unknown, commands)}"
    if isinstance(error, MissingArgumentError) and (missing := error.argument) is not None:
        name = missing.name.lstrip("-").upper() if _is_positional(missing) else missing.name
        is_given = any(word.partition("=")[0] in missing.names for word in words)
        message = f"{name} requires a value" if is_given else f"{_format_command(words)} requires {name}"
        return f"{message}; see {_format_command(words)} --help"
    if isinstance(error, CycloptsError):
        message = " ".join(str(error).split()).rstrip(".")
        return message if message.endswith("?") else f"{message}; see {_format_command(words)} --help"
    if isinstance(error, OSError) and error.errno in (errno.ENOSPC, errno.EDQUOT, errno.EFBIG, errno.EIO):
        # File errors have their own sentence; this is printing to a full disk.
        _close_output()
        return f"the output cannot be written: {os.strerror(error.errno)}; redirect it to another disk"
    if isinstance(error, OSError) and error.filename is not None:
        return f"{error.filename}: {error.strerror}; choose another path"
    return ""


def _run_command(words: list[str]) -> None:
    """Run the command in the arguments."""
    command = find_command(words)
    if command.default_command is not None:
        command.help = None  # The help of a command is its whole docstring, not its line in the list.
    function, bound, _ = app.parse_args(words, exit_on_error=False, print_error=False)
    reject_unknown_options(bound.args, words)
    quiet = any(getattr(value, "quiet", False) for value in bound.arguments.values())
    with notes_for("nobody" if quiet else "everybody", create_spelling(command)):
        function(*bound.args, **bound.kwargs)
    sys.stdout.flush()


def _close_output() -> None:
    """Discard all remaining output."""
    os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())


def create_spelling(command: App) -> Spelling:
    """Create a function that spells an argument as the command's option, if there is one."""

    @functools.cache  # The command is inspected only when a message names an argument.
    def options() -> frozenset[str]:
        return frozenset(_list_options(command))

    return lambda name: format_option_name(name) if format_option_name(name) in options() else name


def find_command(arguments: Sequence[str]) -> App:
    """Find the called command, or the program if there is none. The parser treats --help as a command."""
    return app.parse_commands(arguments)[1][len(_find_command_words(arguments))]


def reject_unknown_options(values: Iterable[object], arguments: Sequence[str]) -> None:
    """Check that no record name is an unknown option. After "--" any name is allowed."""
    typed = arguments[: arguments.index("--")] if "--" in arguments else arguments
    for value in values:
        if isinstance(value, str) and value.startswith("-") and value.lstrip("-")[:1].isalpha() and value in typed:
            option = value.partition("=")[0]
            # Short names are too alike to guess: a suggestion must not lead to another quantity.
            known = _list_options(find_command(arguments)) if len(option) > len("--pga") else ()
            options_by_word = {name.lstrip("-"): name for name in known if len(name) > len("--pga")}
            # The cutoff allows a typo of one or two letters in six.
            hint = suggest(option.lstrip("-"), options_by_word, "see its --help", 0.8)
            raise OptionError(f"{_format_command(arguments)} has no option {option}; {hint}")


def _format_command(arguments: Sequence[str]) -> str:
    """Format the called command as it is typed."""
    return " ".join(["rocking", *_find_command_words(arguments)])


def _find_command_words(arguments: Sequence[str]) -> list[str]:
    return [word for word in app.parse_commands(arguments)[0] if word not in app.help_flags]


def _list_options(command: App) -> Iterable[str]:
    """List the options of a command without its positional arguments."""
    if command.default_command is None:
        return ()
    options = [argument for argument in command.assemble_argument_collection() if not _is_positional(argument)]
    return [name for argument in options for name in argument.names if name.startswith("-")]


def _is_positional(argument: Argument) -> bool:
    return not argument.keys and argument.field_info.kind is not Parameter.KEYWORD_ONLY
