"""Translate kernels into LLVM's language, and optimise them: the steps of a build that need numba.

python lowering.py lower FOLDER SHARE      # a share of the kernels, 0 or 1, not optimised yet
python lowering.py level FOLDER -          # the name of the highest level of this processor
python lowering.py optimise FOLDER LEVEL   # machine code of all kernels for a level of the processor
python lowering.py page FOLDER -           # WebAssembly of the kernels of the standalone page

A function around each kernel unpacks arguments from the eight bytes each that `rocking.kernels.library` packs.

numba optimises every function that it compiles together with all that it calls, and does so again at every level of
calls. Here each function ends as intermediate code, simplified by itself (otherwise branches in a part would prevent
that loops into which it is inlined are vectorised). All functions are then optimised once and together, so that what
several kernels call is in a library once. This uses private members of numba, whose version the build fixes.
"""

from __future__ import annotations

import ctypes
import hashlib
import itertools
import json
import platform
import re
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import llvmlite.binding as llvm
import numba
import numba.np.numpy_support as support
from libraries import LEVELS, MACHINE, PAGE_KERNELS
from numba import types
from numba.core.bytecode import FunctionIdentity
from numba.core.codegen import AOTCPUCodegen, CodeLibrary, JITCodeLibrary
from numba.core.compiler import CompilerBase, DefaultPassBuilder
from numba.core.compiler_lock import global_compiler_lock
from numba.core.compiler_machinery import PassManager, register_pass
from numba.core.datamodel.models import OpaqueModel
from numba.core.typed_passes import NativeLowering
from numba.core.types.misc import unliteral
from numba.extending import register_model

from rocking.kernels import compiled

#: Modules of the kernels that one process translates; a second one translates the others, which takes about as long.
MARCHES = ("march", "lanes", "periodic")

#: Bits that levels of x86-64 processors need, by the instruction that reports them, its argument and the number of the
#: register; the first level that needs them. The operating system must save the registers of AVX2 and AVX-512, too.
CPUID, XGETBV = "cpuid", "xgetbv"
NEEDED = [
    (CPUID, 1, 2, (12, 22, 27, 28, 29), 1),  # FMA, MOVBE, OSXSAVE, AVX, F16C
    (CPUID, 7, 1, (3, 5, 8), 1),  # BMI1, AVX2, BMI2
    (CPUID, 0x80000001, 2, (5,), 1),  # LZCNT
    (XGETBV, 0, 0, (1, 2), 1),
    (CPUID, 7, 1, (16, 17, 28, 30, 31), 2),  # AVX512F, DQ, CD, BW, VL
    (XGETBV, 0, 0, (5, 6, 7), 2),
]


def level_function() -> str:
    """Return the function that every library has, in LLVM's language: the number of the processor's highest level."""
    if MACHINE != "x86_64":
        return "define i64 @rocking_level() {\n  ret i64 0\n}\n"
    lines = ["define i64 @rocking_level() {", "  br label %bits0"]
    for k, (instruction, leaf, register, bits, level) in enumerate(NEEDED):
        results, constraints = ("{ i32, i32, i32, i32 }", "={ax},={bx},={cx},={dx},{ax},{cx}")
        given, mask = f"(i32 {leaf - (leaf >> 31 << 32)}, i32 0)", sum(1 << bit for bit in bits)
        if instruction == XGETBV:
            results, constraints, given = "{ i32, i32 }", "={ax},={dx},{cx}", f"(i32 {leaf})"
        lines += [
            f"bits{k}:",
            f'  %all{k} = call {results} asm sideeffect "{instruction}", "{constraints}"{given}',
            f"  %one{k} = extractvalue {results} %all{k}, {register}",
            f"  %set{k} = and i32 %one{k}, {mask}",
            f"  %has{k} = icmp eq i32 %set{k}, {mask}",
            f"  br i1 %has{k}, label %bits{k + 1}, label %without{k}",
            f"without{k}:",
            f"  ret i64 {level - 1}",
        ]
    return "\n".join([*lines, f"bits{len(NEEDED)}:", "  ret i64 2", "}", ""])


#: The first version of the GNU C library for a processor. Its functions are linked in that version, so that a library
#: works on older systems too: `exp` and others have newer versions, which report errors in another way.
FIRST_VERSION = {"x86_64": "GLIBC_2.2.5", "arm64": "GLIBC_2.17"}


class PartLibrary(JITCodeLibrary):
    """Code that is linked into other libraries, and neither optimised nor turned into machine code for itself."""

    def __init__(self, codegen: Any, name: str) -> None:
        super().__init__(codegen, name)
        self._needed: dict[CodeLibrary, None] = {}

    def add_linking_library(self, library: CodeLibrary) -> None:
        """Remember a library that this code calls: wherever this library is linked, that one has to be linked, too."""
        super().add_linking_library(library)
        self._needed[library] = None

    def with_needed(self) -> list[CodeLibrary]:
        """List this library and all that it calls, directly or indirectly."""
        return [self, *self._needed]

    def finalize(self) -> None:
        """Accept no more code; do not optimise it."""
        self._finalized = True


@register_pass(mutates_CFG=True, analysis_only=False)
class PartLowering(NativeLowering):
    """The last pass over a function: from typed Python to intermediate code."""

    _name = "part_lowering"

    def run_pass(self, state: Any) -> bool:
        """Lower into a `PartLibrary`, and register the code with all that it needs for its callers."""
        context = state.targetctx
        state.library = PartLibrary(context.codegen(), state.func_id.func_qualname)
        state.flags.no_compile = True
        super().run_pass(state)
        lowered = state["cr"]
        # numba identifies compiled functions by the C function that Python calls. Here there is none: any unique
        # callable serves, and is never called.
        name: Callable[[Any], None] = [].append
        context.insert_user_function(name, lowered.fndesc, state.library.with_needed())
        state["cr"] = lowered._replace(cfunc=name)
        return True


class PartCompiler(CompilerBase):
    """numba's compiler up to intermediate code, without passes over what kernels do not contain."""

    def define_pipelines(self) -> list[PassManager]:
        """Choose the passes."""
        usual = DefaultPassBuilder.define_nopython_pipeline(self.state)
        chosen = PassManager(usual.pipeline_name)
        for step, description in usual.passes:
            if step.__name__ not in ("InlineClosureLikes", "InlineOverloads", "NopythonRewrites"):
                chosen.add_pass(PartLowering if step is NativeLowering else step, description)
        chosen.finalize()
        return [chosen]


class PartType(types.Dispatcher):
    """Type of a part for its callers: one function for a constant and any other integer."""

    def get_call_type(self, context: Any, args: Any, kws: Any) -> Any:
        """Type of a call."""
        return super().get_call_type(context, tuple(unliteral(one) for one in args), kws)


register_model(PartType)(OpaqueModel)


class Part:
    """A kernel or a part of kernels as intermediate code: what `rocking.kernels.compiled` declares in this process."""

    def __init__(self, function: Callable[..., Any], *, nogil: bool = False, **options: Any) -> None:
        options |= {"pipeline_class": PartCompiler, "no_cpython_wrapper": True, "no_cfunc_wrapper": True}
        self.dispatcher = numba.njit(**options)(function)
        self._numba_type_ = PartType(self.dispatcher)


def described(kind: Any) -> Any:
    """Describe a type of numba's for the manifest (see `rocking.kernels.library`)."""
    if isinstance(kind, types.Record):
        return {"record": str(support.as_dtype(kind).descr)}
    if isinstance(kind, types.Array):
        if kind.layout != "C":
            raise TypeError(f"{kind} is not contiguous")
        about = {"dimensions": kind.ndim, "readonly": not kind.mutable, "aligned": kind.aligned}
        return {"items": str(support.as_dtype(kind.dtype).descr), **about}
    if isinstance(kind, types.BaseTuple):
        return {"tuple": [described(member) for member in kind.types]}
    for name, plain in (("bool", types.Boolean), ("int", (types.Integer, types.IntEnumMember)), ("float", types.Float)):
        if isinstance(kind, plain):
            return name
    raise TypeError(f"there is no rule for arguments of type {kind}")


class Unpacking:
    """The function around a kernel's own: it unpacks arguments, eight bytes each, and gives numbers back.

    numba passes a record as its address, a tuple as its members, and an array as owner, parent, number of items, bytes
    of an item, data, shape and strides, one after the other.
    """

    def __init__(self) -> None:
        self.lines: list[str] = []
        self.passed: list[str] = []
        self.names = 0
        self.places = 0

    def name(self, expression: str) -> str:
        """Give the value of an expression a name."""
        self.names += 1
        self.lines.append(f"  %v{self.names} = {expression}")
        return f"%v{self.names}"

    def unpacked(self, kind: str) -> str:
        """Unpack the next eight bytes."""
        place = self.name(f"getelementptr i8, ptr %packed, i64 {8 * self.places}")
        self.places += 1
        return self.name(f"load {kind}, ptr {place}, align 8")

    def take(self, kind: Any) -> None:
        """Unpack an argument as numba passes it."""
        if isinstance(kind, types.BaseTuple):
            for member in kind.types:
                self.take(member)
        elif isinstance(kind, types.Array):
            self.take_array(kind)
        elif isinstance(kind, types.Boolean):
            truth = self.unpacked("i64")
            self.passed.append(f"i8 {self.name(f'trunc i64 {truth} to i8')}")
        elif isinstance(kind, types.Record):
            self.passed.append(f"ptr {self.unpacked('ptr')}")
        else:
            plain = "double" if isinstance(kind, types.Float) else "i64"
            self.passed.append(f"{plain} {self.unpacked(plain)}")

    def take_array(self, kind: Any) -> None:
        """Unpack an array's address and shape; all else follows from them, for it is contiguous."""
        size = support.as_dtype(kind.dtype).itemsize
        data = self.unpacked("ptr")
        shape = [self.unpacked("i64") for _ in range(kind.ndim)]
        count, strides = "1", []
        for length in reversed(shape):
            strides.append(str(size) if count == "1" else self.name(f"mul i64 {count}, {size}"))
            count = self.name(f"mul i64 {count}, {length}")
        self.passed += ["ptr null", "ptr null", f"i64 {count}", f"i64 {size}", f"ptr {data}"]
        self.passed += [f"i64 {each}" for each in (*shape, *reversed(strides))]

    def text(self, symbol: str, inner: str, returns: list[str]) -> str:
        """Return the function in LLVM's language: the kernel's number is its result, several are written to %answer."""
        kinds = ["double" if each == "float" else "i64" for each in returns]
        result = kinds[0] if len(kinds) == 1 else "void"
        space = "%answer" if len(kinds) > 1 else "%own"
        lines = [
            f"define {result} @{symbol}(ptr %packed, ptr %answer) {{",
            "  %own = alloca i64",
            "  %problem = alloca ptr",
            *self.lines,
            f"  call i32 @{inner}({', '.join([f'ptr {space}', 'ptr %problem', *self.passed])})",
        ]
        if result == "void":
            return "\n".join([*lines, "  ret void", "}"])
        return "\n".join([*lines, f"  %result = load {result}, ptr %own", f"  ret {result} %result", "}"])


def name_alike(share: int) -> None:
    """Name our functions alike in every process, so that code that both have translated becomes one when it is linked.

    numba numbers functions and types of records in the order in which it meets them. A module has one function of a
    name; records of equal fields are the same. Functions of numba itself keep numbers, which no two processes share.
    """
    identify = FunctionIdentity.from_function.__func__

    def identified(cls: type[FunctionIdentity], function: Any) -> FunctionIdentity:
        made = identify(cls, function)
        if made.modname.startswith("rocking."):
            made.unique_id, made.unique_name = 0, made.func_qualname
        return made

    def fields(kind: types.Record) -> tuple[str, tuple[int]]:
        return "Record", (int(hashlib.sha256(str(kind).encode()).hexdigest()[:12], 16),)

    FunctionIdentity.from_function = classmethod(identified)
    FunctionIdentity._unique_ids = itertools.count(1 + 10**6 * share)
    types.Record.mangling_args = property(fields)


def lower(folder: Path, share: str) -> None:
    """Write a share of the kernels with all that they call, the functions around them, and the manifest's part."""
    name_alike(int(share))
    compiled.compiler = Part
    from rocking.kernels.signatures import find_kernel, sample_arguments

    module, linked, around = llvm.parse_assembly(""), set(), []
    manifest: dict[str, dict[str, Any]] = {}
    for name, arguments in sample_arguments().items():
        if (name.partition(".")[0] in MARCHES) != (share == "0"):
            continue
        part: Part = find_kernel(name)
        kinds = tuple(numba.typeof(argument) for argument in arguments)
        part.dispatcher.compile(kinds)
        made = part.dispatcher.overloads[kinds]
        # Linking drops what nothing refers to so far: a kernel comes before its parts.
        module.link_in(llvm.parse_assembly(made.library.get_llvm_str()))
        for needed in made.library.with_needed()[1:]:
            if needed not in linked:
                module.link_in(needed._get_module_for_linking(), preserve=True)
                linked.add(needed)
        symbol = f"rocking_{name.replace('.', '_')}"
        unpacking = Unpacking()
        for kind in kinds:
            unpacking.take(kind)
        returns = numbers_of(made.signature.return_type)
        around.append(unpacking.text(symbol, f'"{made.fndesc.llvm_func_name}"', returns))
        manifest[name] = {"symbol": symbol, "arguments": [described(kind) for kind in kinds], "returns": returns}
    (folder / f"{share}.ll").write_text(str(module), "utf-8")
    (folder / f"{share}.around").write_text("\n".join(around), "utf-8")
    (folder / f"{share}.json").write_text(json.dumps(manifest), "utf-8")


def optimise(folder: Path, level: str) -> None:
    """Write machine code of what `lower` has written, optimised for a level as numba does it there."""
    made = AOTCPUCodegen("rocking", level).create_library("kernels")
    with global_compiler_lock:
        for share in sorted(folder.glob("*.ll")):
            made.add_llvm_module(llvm.parse_assembly(share.read_text("utf-8")))
        made.finalize()
    target = llvm.Target.from_triple(llvm.get_process_triple())
    machine = target.create_target_machine(cpu=level, features="", opt=3, reloc="pic", codemodel="default")
    around = [share.read_text("utf-8") for share in sorted(folder.glob("*.around"))]
    (folder / f"{level}.o").write_bytes(object_of("\n".join([made.get_llvm_str(), *around, level_function()]), machine))


def page(folder: Path, _: str) -> None:
    """Write WebAssembly of the kernels of the standalone page: of the same code, with addresses of four bytes."""
    llvm.initialize_all_targets()
    llvm.initialize_all_asmprinters()
    target = llvm.Target.from_triple("wasm32-unknown-unknown")
    machine = target.create_target_machine(cpu="generic", features="", opt=3, reloc="static", codemodel="default")

    def for_target(text: str) -> str:
        layout = re.sub(r"^(target datalayout = ).*$", rf'\1"{machine.target_data}"', text, flags=re.MULTILINE)
        return re.sub(r"^(target triple = ).*$", r'\1"wasm32-unknown-unknown"', layout, flags=re.MULTILINE)

    linked = llvm.parse_assembly("")
    for share in sorted(folder.glob("*.ll")):
        linked.link_in(llvm.parse_assembly(for_target(share.read_text("utf-8"))))
    around = [share.read_text("utf-8") for share in sorted(folder.glob("*.around"))]
    module = llvm.parse_assembly("\n".join([for_target(str(linked)), *around]))
    keep_only(module, {f"rocking_{name.replace('.', '_')}" for name in PAGE_KERNELS}, machine)
    options = llvm.create_pipeline_tuning_options(speed_level=3)
    options.loop_vectorization = options.slp_vectorization = False
    builder = llvm.create_pass_builder(machine, options)
    builder.getModulePassManager().run(module, builder)
    (folder / "page.o").write_bytes(machine.emit_object(module))


def keep_only(module: llvm.ModuleRef, names: set[str], machine: llvm.TargetMachine) -> None:
    """Remove whatever these functions do not call."""
    for each in [*module.functions, *module.global_variables]:
        if not (each.is_declaration or each.name in names or each.linkage == llvm.Linkage.private):
            each.linkage = llvm.Linkage.internal
    builder = llvm.create_pass_builder(machine, llvm.create_pipeline_tuning_options(speed_level=3))
    passes = llvm.create_new_module_pass_manager()
    passes.add_global_dead_code_eliminate_pass()
    passes.run(module, builder)


def object_of(text: str, machine: llvm.TargetMachine) -> bytes:
    """Machine code of the functions whose names begin with rocking_, with what they call and nothing else."""
    module = llvm.parse_assembly(text)
    keep_only(module, {each.name for each in module.functions if each.name.startswith("rocking_")}, machine)
    # A function of the C library has its own name, or one that LLVM knows: llvm.exp.f32 calls expf.
    declared = {each.name for each in module.functions if each.is_declaration}
    known = (re.fullmatch(r"llvm\.(\w+)\.f(32|64)", name) for name in declared)
    wanted = {name for name in declared if not name.startswith("llvm.")}
    wanted |= {each[1] + ("f" if each[2] == "32" else "") for each in known if each}
    if unknown := {name for name in wanted if name.startswith(("numba", "NRT", "Py", "_ZN"))}:
        raise RuntimeError(f"kernels need {', '.join(sorted(unknown))}, which only numba and Python have")
    if platform.libc_ver()[0] == "glibc":
        first = FIRST_VERSION[MACHINE]
        versions = "\n".join(f'module asm ".symver {name},{name}@{first}"' for name in sorted(wanted))
        module = llvm.parse_assembly(f"{module}\n{versions}")
    code: bytes = machine.emit_object(module)
    return code


def level(folder: Path, _: str) -> None:
    """Write the number of the highest level of this processor, as a library answers later."""
    machine = llvm.Target.from_triple(llvm.get_process_triple()).create_target_machine()
    with llvm.create_mcjit_compiler(llvm.parse_assembly(level_function()), machine) as engine:
        engine.finalize_object()
        number = ctypes.CFUNCTYPE(ctypes.c_int64)(engine.get_function_address("rocking_level"))()
    (folder / "level").write_text(LEVELS[number], "utf-8")


def numbers_of(returned: Any) -> list[str]:
    """List the kinds of numbers that a kernel returns."""
    if isinstance(returned, types.NoneType):
        return []
    return [described(member) for member in (returned.types if isinstance(returned, types.BaseTuple) else [returned])]


if __name__ == "__main__":
    llvm.initialize_native_target()
    llvm.initialize_native_asmprinter()
    llvm.initialize_native_asmparser()
    step, folder, argument = sys.argv[1:]
    {"lower": lower, "optimise": optimise, "level": level, "page": page}[step](Path(folder), argument)
