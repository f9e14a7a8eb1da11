"""Parts of kernels: linked into the kernels that call them, and no kernels themselves."""

import gc
import math
from collections.abc import Callable

import pytest

from rocking.kernels import compiler
from rocking.kernels.compiled import UNCOMPILED, inlined, kernel, shared

pytestmark = pytest.mark.skipif(UNCOMPILED, reason="nothing is compiled")

Unary = Callable[[float], float]


def chain(first: Callable[[Unary], Unary], second: Callable[[Unary], Unary]) -> tuple[Unary, Unary]:
    """A part that calls another, and a kernel that calls the first."""

    @second
    def root(x: float) -> float:
        return math.sqrt(x)

    @first
    def longer(x: float) -> float:
        return 1.0 + root(x)

    @kernel
    def twice(x: float) -> float:
        return 2.0 * longer(x)

    return longer, twice


@pytest.mark.cases(fast=2)
@pytest.mark.parametrize("first", [inlined, shared])
@pytest.mark.parametrize("second", [inlined, shared])
def test_a_part_serves_kernels_and_python_in_any_order(
    first: Callable[[Unary], Unary], second: Callable[[Unary], Unary]
) -> None:
    longer, twice = chain(first, second)
    assert twice(9.0) == 8.0
    assert longer(9.0) == 4.0
    longer, twice = chain(first, second)
    assert longer(9.0) == 4.0
    assert twice(9.0) == 8.0


def test_a_part_is_compiled_once_for_all_integers() -> None:
    @shared
    def plus(k: int, x: float) -> float:
        return k + x

    @kernel
    def several(k: int, x: float) -> float:
        return plus(1, x) + plus(2, x) + plus(k, x)

    assert several(3, 0.5) == 7.5
    assert len(plus.compiled.dispatcher.signatures) == 1


def test_what_an_inlined_part_calls_is_not_inlined_for_that() -> None:
    """numba hands a wish for inlining down from a caller to all that it calls."""

    @shared
    def inner(x: float) -> float:
        return x + 1.0

    @inlined
    def outer(x: float) -> float:
        return inner(x)

    @kernel
    def whole(x: float) -> float:
        return outer(x)

    assert whole(1.0) == 2.0
    (compiled,) = inner.compiled.dispatcher.overloads.values()
    assert not compiled.fndesc.inline
    (compiled,) = outer.compiled.dispatcher.overloads.values()
    assert compiled.fndesc.inline


def test_parts_are_compiled_in_numbas_own_way_where_its_libraries_are_others(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(compiler, "_POSSIBLE", False)
    longer, twice = chain(inlined, shared)
    assert twice(9.0) == 8.0
    assert not isinstance(longer.compiled, compiler.Part)
    assert longer(9.0) == 4.0


@pytest.mark.parametrize("collects", [True, False])
def test_the_search_for_garbage_goes_on_as_it_was(collects: bool) -> None:
    before = gc.isenabled()
    try:
        (gc.enable if collects else gc.disable)()
        _, twice = chain(inlined, shared)
        assert twice(9.0) == 8.0
        assert gc.isenabled() == collects
    finally:
        (gc.enable if before else gc.disable)()


def test_a_kernel_may_call_another_that_has_parts_in_common_with_it() -> None:
    """The other one's copies of parts must not hide what only this one's copies call."""

    @inlined
    def innermost(x: float) -> float:
        return x + 1.0

    @shared
    def common(x: float) -> float:  # too long to be inlined
        x = math.erf(math.expm1(math.erf(math.expm1(math.erf(math.expm1(math.erf(math.expm1(x))))))))
        x = math.erf(math.expm1(math.erf(math.expm1(math.erf(math.expm1(math.erf(math.expm1(x))))))))
        x = math.erf(math.expm1(math.erf(math.expm1(math.erf(math.expm1(math.erf(math.expm1(x))))))))
        return innermost(x)

    @kernel
    def other(x: float) -> float:
        return common(x) + common(x + 1.0)

    @shared
    def last(x: float) -> float:
        return 2.0 * innermost(x)

    @kernel
    def whole(x: float) -> float:
        return other(x) + common(x) + last(x)

    assert whole(0.5) == other(0.5) + common(0.5) + 3.0
