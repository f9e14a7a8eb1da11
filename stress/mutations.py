"""Small mistakes that a program may have, made on purpose: what `mutants.py` draws from.

An operator that is another one, a bound that is left out or let in, a number that is one more or less, a condition that
is turned round, an argument, an assignment or an error that is missing. Text that people read is left alone, and so are
annotations, which nothing runs.
"""

from __future__ import annotations

import ast
import copy
import functools
import hashlib
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

_OTHER: dict[type[ast.AST], type[Any]] = {
    ast.Lt: ast.LtE,
    ast.LtE: ast.Lt,
    ast.Gt: ast.GtE,
    ast.GtE: ast.Gt,
    ast.Eq: ast.NotEq,
    ast.NotEq: ast.Eq,
    ast.Is: ast.IsNot,
    ast.IsNot: ast.Is,
    ast.In: ast.NotIn,
    ast.NotIn: ast.In,
    ast.Add: ast.Sub,
    ast.Sub: ast.Add,
    ast.Mult: ast.Div,
    ast.Div: ast.Mult,
    ast.FloorDiv: ast.Mult,
    ast.Mod: ast.Mult,
    ast.Pow: ast.Mult,
    ast.BitAnd: ast.BitOr,
    ast.BitOr: ast.BitAnd,
    ast.And: ast.Or,
    ast.Or: ast.And,
}


@dataclass(frozen=True)
class Mutant:
    """A file, and its text with one mistake."""

    path: Path
    line: int
    #: That line of the file.
    code: str
    #: What the code was, and what it is.
    before: str
    after: str
    text: str

    @property
    def change(self) -> str:
        """The change in one line."""
        return f"{self.before} -> {self.after}"

    @property
    def becomes(self) -> str:
        """The line after the change."""
        return self.text.splitlines()[self.line - 1].strip()

    @property
    def key(self) -> str:
        """Hash of the text."""
        return hashlib.sha256(f"{self.path.name}\0{self.text}".encode()).hexdigest()[:20]


@functools.cache
def mutants(path: Path) -> list[Mutant]:
    """All mutants of a file, in the order of its text."""
    source = path.read_bytes()
    starts = [0]
    for line in source.splitlines(keepends=True):
        starts.append(starts[-1] + len(line))
    found = []
    for node, other in _changes(ast.parse(source)):
        first, last = (
            starts[node.lineno - 1] + node.col_offset,
            starts[(node.end_lineno or 0) - 1] + (node.end_col_offset or 0),
        )
        after = ast.unparse(other)
        written = after if isinstance(node, ast.stmt) else f"({after})"
        text = source[:first] + written.encode() + source[last:]
        code = source.splitlines()[node.lineno - 1].decode().strip()
        found.append(Mutant(path, node.lineno, code, ast.unparse(node), after, text.decode()))
    return found


def _changes(tree: ast.AST) -> Iterator[tuple[ast.expr | ast.stmt, ast.AST]]:
    """Each statement or expression that may be wrong, and one way in which it is."""
    for node in _run(tree):
        if isinstance(node, ast.expr):
            yield from ((node, other) for other in _expressions(node))
        elif isinstance(node, ast.AugAssign | ast.Raise) or (
            (isinstance(node, ast.Expr) and isinstance(node.value, ast.Call))
            or (isinstance(node, ast.Assign) and isinstance(node.targets[0], ast.Attribute | ast.Subscript))
        ):
            yield node, ast.Pass()
        if isinstance(node, ast.If | ast.While | ast.IfExp) and not isinstance(node.test, ast.Constant):
            yield node.test, _negated(node.test)


def _run(node: ast.AST) -> Iterator[ast.AST]:
    """All nodes of a tree that are run: no annotations, no formats of text, no imports for types."""
    for field, value in ast.iter_fields(node):
        if field in ("annotation", "returns"):
            continue
        for child in value if isinstance(value, list) else [value]:
            if isinstance(child, ast.JoinedStr) or not isinstance(child, ast.AST):
                continue
            if isinstance(child, ast.If) and ast.unparse(child.test) == "TYPE_CHECKING":
                continue
            yield child
            yield from _run(child)


def _expressions(node: ast.expr) -> Iterator[ast.expr]:
    """Make one mistake in an expression, each in turn."""
    other: Any = copy.copy(node)
    match node:
        case ast.Compare(ops=[operator, *rest]):
            yield ast.Compare(node.left, [_OTHER[type(operator)](), *rest], node.comparators)
        case ast.BinOp(op=operator) | ast.BoolOp(op=operator) if type(operator) in _OTHER:
            other.op = _OTHER[type(operator)]()
            yield other
        case ast.UnaryOp(op=ast.USub() | ast.Not()):
            yield node.operand
        case ast.Constant(value=bool(value)):
            yield ast.Constant(not value)
        case ast.Constant(value=int(value) | float(value)):
            yield ast.Constant(value + 1)
            if isinstance(value, int):
                yield ast.Constant(value - 1)
        case ast.Call(keywords=keywords):
            for left_out in keywords:
                if left_out.arg:
                    yield ast.Call(node.func, node.args, [each for each in keywords if each is not left_out])


def _negated(test: ast.expr) -> ast.expr:
    return ast.UnaryOp(ast.Not(), test)
