"""Hashes of the kernels' sources. This module imports only the standard library because the build runs it alone."""

import ast
import hashlib
from collections.abc import Callable
from pathlib import Path


def hash_text(folder: Path) -> str:
    """Hash the text of all kernels."""
    return _hash_files(folder, lambda text: text)


def hash_code(folder: Path) -> str:
    """Hash the code of all kernels without comments and docstrings, slower than `hash_text`."""
    return _hash_files(folder, _strip_docstrings)


def _hash_files(folder: Path, extract: Callable[[bytes], bytes]) -> str:
    digest = hashlib.sha256()
    for path in sorted(folder.rglob("*.py")):
        name = path.relative_to(folder).as_posix()
        digest.update(name.encode() + b"\0" + extract(path.read_bytes()) + b"\0")
    return digest.hexdigest()[:16]


def _strip_docstrings(text: bytes) -> bytes:
    tree = ast.parse(text)
    for node in ast.walk(tree):
        if isinstance(node, (ast.Module, ast.ClassDef, ast.FunctionDef)) and ast.get_docstring(node, clean=False):
            del node.body[0]
    return ast.dump(tree).encode()
