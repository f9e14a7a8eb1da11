"""TOML files with the line of every mistake."""

from __future__ import annotations

import contextlib
import re
import tomllib
from collections.abc import Iterator
from pathlib import Path
from typing import Any, TypeVar

from rocking.core import checks
from rocking.errors import MotionError, RecordError, RockingError, StudyError

_Error = TypeVar("_Error", bound=RockingError)


class TomlFile:
    """Tables of a file, with the line of each key."""

    def __init__(self, path: str | Path) -> None:
        self.file = checks.path(path, "the file of a study", StudyError)
        try:
            self.text = self.file.read_text("utf-8-sig")
            self.tables = tomllib.loads(self.text)
        except OSError as error:
            raise StudyError(f"the file cannot be read: {error.strerror or error}", path=str(self.file)) from None
        except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
            raise StudyError(f"this is not a valid TOML file: {error}; correct it", path=str(self.file)) from None

    def table(self, table: str, occurrence: int = 0) -> Any:
        """Return the content of a table (in a list of tables, by its occurrence), empty if the table is missing."""
        content: Any = self.tables
        for name in table.split("."):
            content = content.get(name, {})
        return content[occurrence] if isinstance(content, list) else content

    @contextlib.contextmanager
    def locating_errors(self, *tables: str, key: str | None = None, occurrence: int = 0) -> Iterator[None]:
        """Add to an error the line of this key, of the first key in these tables that it names, or of the heading."""
        try:
            yield
        except RockingError as error:
            keys = error.message.arguments if key is None else (key,)
            locations = [(table, name) for table in tables for name in keys if name in self.table(table, occurrence)]
            table, name = locations[0] if locations else (tables[0], None)
            raise relocate_error(error, StudyError, self.file, self.find_line(table, name, occurrence)) from None

    @contextlib.contextmanager
    def locating_record_errors(self, name: str) -> Iterator[None]:
        """Add to an error about a record the line that names the record."""
        try:
            yield
        except (RecordError, MotionError) as error:
            first = self.find_line("motions", "records")
            lines = self.text.splitlines()[first - 1 :]
            line = next((k for k, text in enumerate(lines, start=first) if name in text), first)
            raise relocate_error(error, type(error), self.file, line) from None

    def create_error(self, table: str, key: str | None, message: str, *names: str, value: object = None) -> StudyError:
        """Return the error about a key of a table, or about the table."""
        return StudyError(message, *names, path=str(self.file), line=self.find_line(table, key), value=value)

    def find_line(self, table: str, key: str | None, occurrence: int = 0) -> int:
        """Return the line of a key in a table (by its occurrence), of the heading without a key, or 1 if not found."""
        if "." in table and not re.search(rf"^\s*\[+\s*{re.escape(table)}\b", self.text, re.MULTILINE):
            parent, _, name = table.rpartition(".")
            return self.find_line(parent, name)
        current, count, heading_line = "", -1, 0
        for number, line in enumerate(self.text.splitlines(), start=1):
            if heading := re.match(r"\s*\[+\s*([\w.]+)\s*\]+", line):
                current = heading[1]
                count += current == table
                if key is not None and current == f"{table}.{key}":
                    return number
                if current == table and count == occurrence:
                    heading_line = number
                elif current.startswith(f"{table}."):
                    heading_line = heading_line or number  # only a part of the table has a heading
            match = re.match(r"\s*([\w.-]+)\s*=", line)
            if match and key is not None and current == table and max(count, 0) == occurrence and match[1] == key:
                return number
        return heading_line or 1


def relocate_error(error: RockingError, error_type: type[_Error], file: Path, line: int) -> _Error:
    """Return an error with the same data, and with a line of a file before its own location."""
    message = error.text().removesuffix(error.message.text()) + error.message.template
    return error_type(message, *error.message.arguments, path=str(file), line=line, value=error.value)
