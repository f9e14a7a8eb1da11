"""Which files of tests judge what was changed: by their names, and by what they and the package import.

    python tests/of_changes.py HEAD                     # since the last commit
    python tests/of_changes.py COMMIT python -m pytest  # since that one

prints their paths, the nearest first, or runs a command on them. The last line says on stderr what is left out.
"""

from __future__ import annotations

import ast
import re
import subprocess
import sys
from collections import defaultdict
from collections.abc import Iterable, Iterator
from functools import cached_property
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]

#: Files of tests at most.
MOST = 12

#: How many imports farther than the nearest file of tests another one may be.
FARTHER = 2

#: How many imports away one is that imports nothing which leads to the module, but shares a word of its name.
BY_NAME = 3


def words(name: str) -> set[str]:
    """Words of a module's or a test's name, in the singular: `studies/refine` and `study_refine` share two."""
    return {re.sub("ies$", "y", word).removesuffix("s") for word in re.split(r"[\W_]+", name)}


def dotted(node: ast.expr) -> str:
    """Name with its attributes, as it is written; empty for the attributes of anything else."""
    if isinstance(node, ast.Attribute):
        return f"{before}.{node.attr}" if (before := dotted(node.value)) else ""
    return node.id if isinstance(node, ast.Name) else ""


def names_used(tree: ast.AST, package: str) -> Iterator[str]:
    """Dotted names that a module imports, reads from what it imports, or writes in a string."""
    imported, nodes = {}, [*ast.walk(tree)]
    for node in nodes:
        if isinstance(node, ast.Import):
            for alias in node.names:
                imported[alias.asname or alias.name] = alias.name
        elif isinstance(node, ast.ImportFrom):
            parents = package.split(".")[: 1 - node.level or None] if node.level else []
            source = ".".join([*parents, *filter(None, [node.module])])
            for alias in node.names:
                imported[alias.asname or alias.name] = f"{source}.{alias.name}"
    yield from imported.values()
    for node in nodes:
        if isinstance(node, ast.Attribute):
            first, _, others = dotted(node).partition(".")
            if first in imported:
                yield f"{imported[first]}.{others}"
        elif isinstance(node, ast.Constant) and isinstance(node.value, str):
            yield from re.findall(r"\brocking\.[\w.]+", node.value)


class FilesOfTests:
    """The files of tests under a root, and how many imports they are away from each module."""

    def __init__(self, root: Path = ROOT) -> None:
        self.root = root
        self.paths: dict[str, Path] = {}
        for folder in (root / "src", root / "tests"):
            for path in sorted(folder.rglob("*.py")):
                *parents, stem = path.relative_to(folder).with_suffix("").parts
                self.paths[".".join(parents if stem == "__init__" else [*parents, stem])] = path
        self.modules = {path: module for module, path in self.paths.items()}
        self.files = [path for path in self.modules if path.name.startswith("test_")]

    @cached_property
    def public(self) -> dict[str, str]:
        """Where a public name is defined, from the stubs."""
        found = {}
        for module, path in self.paths.items():
            if (stub := path.with_suffix(".pyi")).exists():
                for name in names_used(ast.parse(stub.read_text("utf-8")), module):
                    found[f"{module}.{name.rpartition('.')[2]}"] = name
        return found

    def module_of(self, name: str) -> str | None:
        """The module that defines a dotted name."""
        rest = ""
        while name:
            # A function may be called as its module is.
            if (target := self.public.get(name)) and not target.startswith(name):
                return self.module_of(target + rest)
            if name in self.paths:
                return name
            name, _, last = name.rpartition(".")
            rest = f".{last}{rest}"
        return None

    @cached_property
    def imported(self) -> dict[str, set[str]]:
        """Modules that each one imports."""
        found = {}
        for module, path in self.paths.items():
            package = module if path.name == "__init__.py" else module.rpartition(".")[0]
            used = names_used(ast.parse(path.read_text("utf-8")), package)
            found[module] = {each for name in used if (each := self.module_of(name))} - {module}
        return found

    @cached_property
    def importers(self) -> dict[str, set[str]]:
        """Modules that import each one."""
        found = defaultdict(set)
        for module, imported in self.imported.items():
            for each in imported:
                found[each].add(module)
        return found

    def of_module(self, module: str, farther: int = FARTHER) -> dict[Path, tuple[int, int]]:
        """Files of tests of a module, each with how far it is and how much else it imports."""
        distances, reached = {module: 0}, [module]
        for each in reached:
            for importer in self.importers.get(each, ()):
                if importer not in distances:
                    distances[importer] = distances[each] + 1
                    reached.append(importer)
        own = words(module) - {"rocking", "test"}
        found = {}
        for path in self.files:
            test, shared = self.modules[path], len(own & words(path.stem))
            if shared or test in distances:
                found[path] = distances.get(test, BY_NAME) - shared, len(self.imported[test])
        farthest = min((far for far, _ in found.values()), default=0) + farther
        return {path: rank for path, rank in found.items() if rank[0] <= farthest}

    def of_other(self, path: Path) -> dict[Path, tuple[int, int]]:
        """Files of tests that name a file which is no module, or else the nearest folder of it that any names."""
        texts = {each: each.read_text("utf-8") for each in self.files}
        for part in reversed(path.relative_to(self.root).parts):
            named = re.compile(rf"[\"'/]{re.escape(part)}[\"'/]")
            if found := [each for each, text in texts.items() if named.search(text)]:
                return {each: (-len(words(path.stem) & words(each.stem)), 0) for each in found}
        return {}

    def of(self, path: Path, farther: int = FARTHER) -> dict[Path, tuple[int, int]]:
        """Files of tests that judge a file, so much farther than the nearest at most, each with its rank."""
        path = path.with_suffix(".py") if path.suffix == ".pyi" else path
        if path in self.files:
            return {path: (-9, 0)}
        return self.of_module(self.modules[path], farther) if path in self.modules else self.of_other(path)


def changed(commit: str = "HEAD", root: Path = ROOT) -> list[Path]:
    """Files that are there and differ from a commit: staged, unstaged or untracked."""
    found = set()
    for command in (f"diff --name-only --diff-filter=d -z {commit}", "ls-files --others --exclude-standard -z"):
        done = subprocess.run(["git", *command.split()], cwd=root, check=True, stdout=subprocess.PIPE, text=True)
        found |= {root / name for name in done.stdout.split("\0") if name}
    return sorted(found)


def ordered(found: Iterable[dict[Path, tuple[int, int]]]) -> list[Path]:
    """All files of tests, the nearest first."""
    nearest: dict[Path, tuple[int, int]] = {}
    for each in found:
        for path, rank in each.items():
            nearest[path] = min(rank, nearest.get(path, rank))
    return sorted(nearest, key=lambda path: (nearest[path], path))


def main() -> int:
    tests = FilesOfTests()
    commit, *command = sys.argv[1:]
    found = {path: tests.of(path) for path in changed(commit)}
    everything = {path: tests.of(path, sys.maxsize) for path in found}
    near, left = ordered(found.values())[:MOST], ordered(everything.values())
    names = [str(path.relative_to(ROOT)) for path in near]
    print(*names, sep="\n", flush=True)
    status = subprocess.call([*command, *names], cwd=ROOT) if command and names else 0
    if unknown := [str(path.relative_to(ROOT)) for path, files in found.items() if not files]:
        print(f"NO TEST IS KNOWN for {', '.join(unknown)}", file=sys.stderr)
    if len(left) > len(near):
        print(
            f"NOT ALL TESTS WERE RUN: {len(left) - len(near)} more files of tests use what has changed; "
            "make test runs them",
            file=sys.stderr,
        )
    elif not found:
        print("nothing has changed", file=sys.stderr)
    return status


if __name__ == "__main__":
    sys.exit(main())
