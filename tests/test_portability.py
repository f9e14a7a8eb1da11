"""What differs between systems, by pretending to be another one, and that nothing else does (docs/portability.md)."""

import ast
import os
import re
from pathlib import Path

import pytest

from rocking.core import threads

ROOT = Path(__file__).resolve().parents[1]
SOURCE = ROOT / "src" / "rocking"
PAGE = (ROOT / "docs" / "portability.md").read_text("utf-8")

#: Modules and members of `os` and `signal` that some systems lack, or where they do something else.
MODULES = {"fcntl", "grp", "msvcrt", "posix", "pty", "pwd", "resource", "syslog", "termios", "tty", "winreg"}
MEMBERS = {
    *("fork", "getgid", "getloadavg", "getuid", "geteuid", "kill", "killpg", "mkfifo", "name", "nice", "posix_fadvise"),
    *("sched_getaffinity", "sched_setaffinity", "setpriority", "setsid", "statvfs", "symlink", "umask", "uname"),
    *("platform", "SIGALRM", "SIGHUP", "SIGKILL", "SIGTERM", "setitimer", "alarm", "SO_REUSEADDR", "getwindowsversion"),
}
MODULES_WITH_MEMBERS = {"os", "sys", "signal", "socket"}


TEXTS = {path.relative_to(SOURCE).as_posix(): path.read_text("utf-8") for path in sorted(SOURCE.rglob("*.py"))}

#: Words without which a module is not read further: to parse all of them takes seconds.
WORDS = re.compile(rf"\bimport ({'|'.join(MODULES)})\b|\b({'|'.join(MODULES_WITH_MEMBERS)})\.({'|'.join(MEMBERS)})\b")


def test_every_place_that_depends_on_the_system_is_on_the_page() -> None:
    assert len(TEXTS) > 100
    places = {name for name, text in TEXTS.items() if WORDS.search(text)}
    assert {"studies/folder.py", "core/threads.py"} <= places
    shown = {name for name in places if f"`{name}`" in PAGE or f"`{name.removesuffix('.py')}." in PAGE}
    assert places - shown == set()


def test_no_module_that_a_system_lacks_is_needed_to_import_the_package() -> None:
    imported = [
        (name, module)
        for name, text in TEXTS.items()
        for module in re.findall(r"^(?:import|from) (\w+)", text, re.MULTILINE)
    ]
    assert len(imported) > 1000
    assert [(name, module) for name, module in imported if module in MODULES] == []


@pytest.mark.thorough
def test_texts_have_one_encoding_and_one_end_of_line_everywhere() -> None:
    judged = 0
    for name, text in TEXTS.items():
        if not re.search(r"open\(.*['\"][rwax]['\"]|read_text\(", text):
            continue
        for call in (node for node in ast.walk(ast.parse(text)) if isinstance(node, ast.Call)):
            function = call.func.attr if isinstance(call.func, ast.Attribute) else getattr(call.func, "id", "")
            options = {each.arg for each in call.keywords}
            modes = [each.value for each in call.args if isinstance(each, ast.Constant) and isinstance(each.value, str)]
            if function == "open" and modes and modes[-1] in ("r", "w", "a", "x"):
                judged += 1
                assert "encoding" in options, (name, call.lineno)
                assert modes[-1] == "r" or "newline" in options, (name, call.lineno)
            if function == "read_text":
                judged += 1
                assert call.args or "encoding" in options, (name, call.lineno)
    assert judged >= 6


def test_cores_are_all_where_no_affinity_is_known(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(os, "cpu_count", lambda: 7)
    monkeypatch.setattr(os, "sched_getaffinity", lambda process: {0, 3}, raising=False)
    assert threads.count_cores() == 2
    monkeypatch.delattr(os, "sched_getaffinity")
    assert threads.count_cores() == 7
    monkeypatch.setattr(os, "cpu_count", lambda: None)
    assert threads.count_cores() == 1
