"""Hashes of the kernels' sources. This module imports only the standard library because the build runs it alone."""

import ast
import hashlib
from collections.abc import Callable
from pathlib import Path


def text_hash(folder: Path) -> str:
    """Hash the text of all kernels."""
    return _hash(folder, lambda text: text)


def code_hash(folder: Path) -> str:
    """Hash the code of all kernels without comments and docstrings, slower than `text_hash`."""
    return _hash(folder, _code)


def _hash(folder: Path, content: Callable[[bytes], bytes]) -> str:
    digest = hashlib.sha256()
    for source in sorted(folder.rglob("*.py")):
        name = source.relative_to(folder).as_posix()
        digest.update(name.encode() + b"\0" + content(source.read_bytes()) + b"\0")
    return digest.hexdigest()[:16]


def _code(text: bytes) -> bytes:
    tree = ast.parse(text)
    for node in ast.walk(tree):
        if isinstance(node, (ast.Module, ast.ClassDef, ast.FunctionDef)) and ast.get_docstring(node, clean=False):
            del node.body[0]
    return ast.dump(tree).encode()
