"""What differs between systems, by pretending to be another one, and that nothing else does (docs/portability.md)."""

import ast
import os
import re
import socket
import sys
from pathlib import Path
from types import SimpleNamespace

import pytest

from rocking.core import threads
from rocking.explorer import apart, launch
from rocking.studies import folder

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
    assert {"explorer/apart.py", "studies/folder.py", "core/threads.py"} <= places
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


def limits(refused: set[int]) -> tuple[SimpleNamespace, dict[int, tuple[int, int]]]:
    """A stand-in for the module `resource` of a system that refuses some limits."""
    kept: dict[int, tuple[int, int]] = {}

    def setrlimit(kind: int, both: tuple[int, int]) -> None:
        if kind in refused:
            raise ValueError("current limit exceeds maximum limit")
        kept[kind] = both

    return SimpleNamespace(RLIMIT_AS=0, RLIMIT_CPU=1, RLIMIT_CORE=2, setrlimit=setrlimit), kept


@pytest.mark.parametrize("refused", [set(), {0}, {0, 1}, {0, 1, 2}])
def test_a_limit_that_the_system_refuses_leaves_the_others(monkeypatch: pytest.MonkeyPatch, refused: set[int]) -> None:
    stand_in, kept = limits(refused)
    monkeypatch.setitem(sys.modules, "resource", stand_in)
    apart._limit_this_process()
    assert set(kept) == {0, 1, 2} - refused


@pytest.mark.parametrize(("system", "reused"), [("linux", True), ("darwin", True), ("win32", False)])
def test_on_windows_no_other_server_may_share_the_port(
    monkeypatch: pytest.MonkeyPatch, system: str, reused: bool
) -> None:
    monkeypatch.setattr(sys, "platform", system)
    with launch._bind_socket("127.0.0.1", 0) as listening:
        assert bool(listening.getsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR)) == reused


class _Windows(SimpleNamespace):
    """The module `os` as Windows has it: what is named is another's, and what it lacks fails."""

    def __getattr__(self, name: str) -> object:
        if name in ("posix_fadvise", "sched_getaffinity", "getuid"):
            raise AttributeError(name)
        return getattr(os, name)


def test_a_study_is_kept_where_folders_cannot_be_flushed(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    def refuse(*given: object) -> None:
        raise PermissionError(13, "Permission denied")

    # Folders cannot be opened.
    monkeypatch.setattr(folder, "os", _Windows(name="nt", open=refuse))
    folder.write_atomically(tmp_path / "units" / "1", b"outcomes")
    assert (tmp_path / "units" / "1").read_bytes() == b"outcomes"


def test_who_holds_a_lock_is_read_without_its_first_byte(tmp_path: Path) -> None:
    with folder.lock_folder(tmp_path):
        held = (tmp_path / "lock").read_bytes()
        assert held[:1] == b" "
        assert held[1:].decode().startswith(f"process {os.getpid()} on ")
