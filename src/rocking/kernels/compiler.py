"""How numba compiles kernels and their parts: `compiled` imports this where something has to be compiled.

IEEE arithmetic, no exceptions, no reference counts. A part is code that is only linked into kernels. numba makes a
library of every function that it compiles: it optimises the function together with all that it calls, makes machine
code of it, and wraps it for callers from Python and from C; and it does all of that again at every level of calls. Here
a part ends as intermediate code, each function simplified by itself (otherwise branches in a part would prevent that
loops into which it is inlined are vectorised). The kernel links all of its parts, and they are optimised once and
together. That halves the time of a first call, and the kernel is as fast.

This uses numba's documented ways to choose the passes over a function, and some members of its libraries. `_POSSIBLE`
checks for them; without them parts are compiled in numba's own way.
"""

import contextlib
import functools
import gc
import importlib
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numba
from numba import types
from numba.core.codegen import CodeLibrary, JITCodeLibrary
from numba.core.compiler import CompilerBase, CompileResult, DefaultPassBuilder, Flags
from numba.core.compiler_machinery import PassManager, register_pass
from numba.core.datamodel.models import OpaqueModel
from numba.core.typed_passes import NativeLowering
from numba.core.types.misc import unliteral
from numba.extending import register_model

from rocking.kernels.kept import KernelCache

#: Whether numba's libraries have the members that `PartLibrary` uses.
_POSSIBLE = hasattr(Flags, "no_compile") and all(
    hasattr(JITCodeLibrary, name) for name in ("_finalized", "_ensure_finalized", "_get_module_for_linking")
)

#: Passes over what kernels have none of: closures, array expressions, functions that numba inlines for itself.
_IDLE_PASSES = ("InlineClosureLikes", "InlineOverloads", "NopythonRewrites")


class KernelLibrary(JITCodeLibrary):
    """A kernel's code."""

    def finalize(self) -> None:
        """Link parts before kernels, then optimise.

        Linking drops what nothing refers to so far. A kernel brings its own copies of parts, in which others have
        been inlined already: linked first, they would take the place of the only ones that refer to those others.
        """
        self._linking_libraries.sort(key=lambda library: not isinstance(library, PartLibrary))
        super().finalize()


class PartLibrary(JITCodeLibrary):
    """Code that is linked into other libraries, and neither optimised nor turned into machine code for itself."""

    def __init__(self, codegen: Any, name: str) -> None:
        super().__init__(codegen, name)
        self._needed: dict[CodeLibrary, None] = {}

    def add_linking_library(self, library: CodeLibrary) -> None:
        """Remember a library that this code calls: with this library that one has to be linked, too."""
        super().add_linking_library(library)
        self._needed[library] = None

    def with_needed(self) -> list[CodeLibrary]:
        """List this library and all that it calls, directly or indirectly."""
        return [self, *self._needed]

    def finalize(self) -> None:
        """Accept no more code; do not optimise it."""
        self._finalized = True


@register_pass(mutates_CFG=True, analysis_only=False)
class KernelLowering(NativeLowering):
    """The last pass over a kernel: from typed Python to machine code."""

    _name = "kernel_lowering"

    def run_pass(self, state: Any) -> bool:
        """Lower into a library of our kind."""
        state.library = KernelLibrary(state.targetctx.codegen(), state.func_id.func_qualname)
        state.library.enable_object_caching()
        return bool(super().run_pass(state))


@register_pass(mutates_CFG=True, analysis_only=False)
class PartLowering(NativeLowering):
    """The last pass over a part: from typed Python to intermediate code."""

    _name = "part_lowering"

    def run_pass(self, state: Any) -> bool:
        """Lower into a `PartLibrary`, and register the code with all that it needs for its callers."""
        context = state.targetctx
        state.library = PartLibrary(context.codegen(), state.func_id.func_qualname)
        state.flags.no_compile = True
        super().run_pass(state)
        lowered = state["cr"]
        # Compiled functions are identified by the function of C's that Python calls. A part has none: any unique one
        # will do, and is never called, for Python calls a `Part`.
        name: Callable[[Any], None] = [].append
        context.insert_user_function(name, lowered.fndesc, state.library.with_needed())
        state["cr"] = lowered._replace(cfunc=name)
        return True


class KernelCompiler(CompilerBase):
    """numba's compiler, without passes that have nothing to do, and without searches for garbage."""

    lowering = KernelLowering if _POSSIBLE else NativeLowering

    def define_pipelines(self) -> list[PassManager]:
        """Choose the passes."""
        usual = DefaultPassBuilder.define_nopython_pipeline(self.state)
        chosen = PassManager(usual.pipeline_name)
        for step, description in usual.passes:
            if step.__name__ not in _IDLE_PASSES:
                chosen.add_pass(self.lowering if step is NativeLowering else step, description)
        chosen.finalize()
        return [chosen]

    def compile_extra(self, func: Callable[..., Any]) -> CompileResult:
        """Compile a function."""
        with _without_garbage_collection():
            return super().compile_extra(func)


class PartCompiler(KernelCompiler):
    """The same for parts of kernels."""

    lowering = PartLowering


@contextlib.contextmanager
def _without_garbage_collection() -> Iterator[None]:
    """Switch the search for cyclic garbage off: there is little, and the search took a tenth of the time."""
    collecting = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if collecting:
            gc.enable()


class PartType(types.Dispatcher):
    """Type of a part for its callers: a compiled function, the same for a constant as for any other integer."""

    def get_call_type(self, context: Any, args: Any, kws: Any) -> Any:
        """Type of a call."""
        return super().get_call_type(context, tuple(unliteral(one) for one in args), kws)


register_model(PartType)(OpaqueModel)


class Part:
    """A part of kernels. Python may call it, too: through a kernel that does nothing else, kept in a folder."""

    def __init__(self, function: Callable[..., Any], cache: Path | None, **options: Any) -> None:
        functools.update_wrapper(self, function)
        #: The function as it is without compilation, and what kernels call; named as numba names them.
        self.py_func = function
        self.dispatcher = numba.njit(
            pipeline_class=PartCompiler, no_cpython_wrapper=True, no_cfunc_wrapper=True, **options
        )(function)
        self._numba_type_ = PartType(self.dispatcher)
        self._options = options
        self._cache = cache

    def __reduce__(self) -> tuple[Any, ...]:
        """Stand for a part by its name: numba then knows again what it has kept of a function that calls it."""
        return _part_named, (self.py_func.__module__, self.py_func.__qualname__)

    def __call__(self, *arguments: Any) -> Any:
        """Call the part from Python."""
        return self._kernel(*arguments)

    @functools.cached_property
    def _kernel(self) -> Callable[..., Any]:
        part = self

        def call(*arguments: Any) -> Any:
            return part(*arguments)

        call.__qualname__ = f"{self.py_func.__module__}.{self.py_func.__qualname__}"  # a file for each part
        return _kept(call, self._cache, pipeline_class=KernelCompiler, **self._options)


def _part_named(module: str, name: str) -> Any:
    return getattr(importlib.import_module(module), name).compiled


# - error_model: a kernel that divides by zero continues with inf or NaN; its code says what became of it.
# - fast-math is never switched on: the proofs rest on IEEE rounding, and every machine gives the same answer.
# - _nrt=False: kernels never allocate, so counting references to their array arguments (atomic operations, which take
#   longer than a whole Taylor step) is switched off.
_OPTIONS = {"error_model": "numpy", "_nrt": False}

# - forceinline is set for every function: else numba takes it from the first caller, so that one inlined function would
#   inline all that it calls, a march included.
# - no_cfunc_wrapper: kernels are not called from C.
_KERNEL = {"forceinline": False, "no_cfunc_wrapper": True, "pipeline_class": KernelCompiler}


def kernel_of(function: Callable[..., Any], cache: Path | None) -> Any:
    """Compile an entry point that Python calls, kept in a folder, and free of Python's lock while it runs."""
    return _kept(function, cache, nogil=True, **_KERNEL, **_OPTIONS)


def part_of(function: Callable[..., Any], cache: Path | None, *, inline: bool) -> Any:
    """Compile a part of kernels; what calls it from Python is kept in a folder."""
    options = {"forceinline": inline, **_OPTIONS}
    return Part(function, cache, **options) if _POSSIBLE else numba.njit(**options)(function)


def _kept(function: Callable[..., Any], cache: Path | None, **options: Any) -> Any:
    compiled = numba.njit(**options)(function)
    if cache is not None:
        before = numba.config.CACHE_DIR
        numba.config.CACHE_DIR = str(cache)
        try:
            with contextlib.suppress(RuntimeError):
                compiled._cache = KernelCache(function)
        finally:
            numba.config.CACHE_DIR = before
    return compiled
