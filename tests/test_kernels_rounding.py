"""The compiled code rounds after every operation, as IEEE arithmetic does: the proofs rest on it."""

import shutil
from pathlib import Path

import pytest
from oracles.rounding import FUSED, PRODUCTS, RELAXED, assembly, translated

from rocking.kernels import library
from rocking.kernels.signatures import sample_arguments


def test_no_product_and_sum_are_rounded_once() -> None:
    if shutil.which("objdump") is None:
        pytest.skip("objdump is not installed")
    libraries = library.read_manifest()["libraries"]
    assert libraries
    for each in libraries:
        machine = assembly(library.FOLDER / each["file"])
        assert len(PRODUCTS.findall(machine)) >= 20 * len(sample_arguments())
        assert not FUSED.findall(machine)


@pytest.mark.slow
def test_no_operation_may_be_reordered(tmp_path: Path) -> None:
    middle = translated(tmp_path)
    assert middle.count("fmul double") >= 20 * len(sample_arguments())
    assert not RELAXED.findall(middle)
