"""Sphinx extension: the command line's reference, written from the commands themselves.

Each build writes ``reference/commands/NAME.md``, a page for every command, and the list of them. They hold the help
that the terminal shows, so that the two cannot differ, and the pages on which a command is used.
"""

from __future__ import annotations

import inspect
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from cyclopts import App
from cyclopts.help import create_parameter_help_panel

from rocking.cli import app as commands

FOLDER = Path("reference") / "commands"

#: Groups of what a command takes by itself, and their headings.
OWN = {"Arguments": "Arguments", "Parameters": "Options"}

#: What Markdown would take for markup.
MARKUP = re.compile(r"([\\`*_$<>\[\]{}|~])")
#: Options, commands and files within a sentence.
CODE = re.compile(
    r"`([^`]+)`|(?<![\w./-])(--[a-z](?:[a-z-]*[a-z])?|\[[a-z]+\]|[*\w-]*\.(?:csv|nc|png|pdf|json|xlsx|xml|toml|parquet|AT2))(?![\w-])"
)
USED = re.compile(r"^\$ (?:.*[|&] )?rocking ([a-z]+)", re.MULTILINE)


def setup(app: Any) -> dict[str, bool]:
    """Register what writes the pages."""
    app.connect("builder-inited", lambda app: write_pages(Path(app.srcdir)))
    return {"parallel_read_safe": True}


def write_pages(source: Path) -> None:
    """Write the pages of all commands and their list; one that says what it said is left alone."""
    folder = source / FOLDER
    folder.mkdir(parents=True, exist_ok=True)
    used = pages_by_command(source)
    pages = {
        name: "\n".join(
            [
                f"# rocking {name}",
                "",
                *page_of(app, name),
                *used_in(used.get(name, [])),
            ]
        )
        for name, app in commands_of(commands).items()
    }
    pages["index"] = "\n".join(list_of_commands())
    for name, text in pages.items():
        path = folder / f"{name}.md"
        if not path.exists() or path.read_text("utf-8") != text:
            path.write_text(text, "utf-8")
    for path in folder.glob("*.md"):
        if path.stem not in pages:
            path.unlink()


def commands_of(app: App) -> dict[str, App]:
    """Return the commands of an application by name, flags left out."""
    return {name: app[name] for name in app if not name.startswith("-")}


def list_of_commands() -> Iterator[str]:
    """Give the lines of the page that lists all commands."""
    yield from (
        "# Command line",
        "",
        "These pages are written from the commands themselves; `rocking COMMAND --help` says the same in a terminal.",
        "How numbers, angles, lists and records are written, and examples, are in {doc}`/howto/command-line`.",
        "A command ends with exit code 0, with 2 and one line on stderr where something given is wrong, and with 130",
        "when it is interrupted.",
        "",
        "| Command | What it does |",
        "|---|---|",
    )
    names = commands_of(commands)
    for name, app in names.items():
        yield f"| [`rocking {name}`]({name}.md) | {markdown(app.help)} |"
    yield from ("| `rocking --version` | Display the version. |", "")
    yield from (
        "```{toctree}",
        ":hidden:",
        "",
        *(f"rocking {name} <{name}>" for name in names),
        "```",
        "",
    )


def page_of(app: App, name: str, heading: str = "##") -> Iterator[str]:
    """Give the lines of a command: what it does, how it is called, its options by group; and of its own commands."""
    if app.default_command is None:
        yield from (markdown(app.help), "")
        for inner, command in commands_of(app).items():
            yield from (f"## rocking {name} {inner}", "")
            yield from page_of(command, f"{name} {inner}", "###")
        return
    arguments = app.assemble_argument_collection(parse_docstring=True)
    # First what a command takes by itself, then the options that several commands share.
    groups = sorted(
        arguments.groups,
        key=lambda group: (
            group.name not in OWN,
            group.name in OWN or group.sort_key,
        ),
    )
    panels = [
        create_parameter_help_panel(
            group, arguments.filter_by(group=group), "plaintext"
        )
        for group in groups
    ]
    paragraphs = (
        inspect.getdoc(app.default_command)
        .split("\nParameters\n---")[0]
        .strip()
        .split("\n\n")
    )
    yield from (markdown(paragraphs[0]), "")
    yield from (
        "```text",
        usage(name, [entry for panel in panels for entry in panel.entries]),
        "```",
        "",
    )
    for paragraph in paragraphs[1:]:
        yield from (markdown(paragraph), "")
    for panel in panels:
        if panel.entries:
            yield from (f"{heading} {OWN.get(panel.title, panel.title)}", "")
            for entry in panel.entries:
                yield from option(entry)


def usage(name: str, entries: list[Any]) -> str:
    """Return how a command is called."""
    given = [
        entry.positional_label
        for entry in entries
        if entry.positional_label and entry.required
    ]
    others = [
        entry.positional_label
        for entry in entries
        if entry.positional_label and not entry.required
    ]
    optional = any(
        not entry.required and entry.positive_names for entry in entries
    )
    return " ".join(
        [
            "rocking",
            name,
            *given,
            *(f"[{each}]" for each in others),
            *(["[OPTIONS]"] if optional else []),
        ]
    )


def option(entry: Any) -> Iterator[str]:
    """Give the lines of an option: a term and its definition."""
    names = [
        *([entry.positional_label] if entry.positional_label else []),
        *entry.positive_names,
    ]
    names += [*entry.positive_shorts, *entry.negative_names]
    kind = (
        f" {entry.metavar}"
        if entry.metavar and not entry.positional_label
        else ""
    )
    said = [markdown(str(entry.description.primary_renderable))]
    if entry.required:
        said.append("*Required.*")
    if entry.choices:
        said.append(
            f"*One of* {', '.join(f'`{choice}`' for choice in entry.choices)}."
        )
    if entry.default not in (None, "", "()", "False"):
        said.append(f"*Default:* `{entry.default}`.")
    yield from (
        ", ".join(f"`{name}`" for name in names) + kind,
        f": {' '.join(said)}",
        "",
    )


def markdown(text: str) -> str:
    """Return a text of the help as Markdown, with options and names of files as code."""
    text, said, end = " ".join(text.split()), "", 0
    for match in CODE.finditer(text):
        said += (
            MARKUP.sub(r"\\\1", text[end : match.start()])
            + f"`{match[1] or match[2]}`"
        )
        end = match.end()
    return said + MARKUP.sub(r"\\\1", text[end:])


def pages_by_command(source: Path) -> dict[str, list[str]]:
    """Return for each command the pages that show it in a console."""
    found: dict[str, list[str]] = {}
    for path in sorted(source.rglob("*.md")):
        page = path.relative_to(source)
        if (
            page.parts[0] in ("howto", "tutorials", "reference")
            and page.parent != FOLDER
        ):
            for name in sorted(set(USED.findall(path.read_text("utf-8")))):
                found.setdefault(name, []).append(
                    f"/{page.with_suffix('').as_posix()}"
                )
    return found


def used_in(pages: list[str]) -> Iterator[str]:
    """Give the lines that lead to the pages on which a command is used."""
    if pages:
        yield from (
            "## Used in",
            "",
            *(f"- {{doc}}`{page}`" for page in pages),
            "",
        )
