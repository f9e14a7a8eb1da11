"""Make libraries of compiled kernels for this platform: a wheel that is built next holds them.

python scripts/ship_kernels.py            # build/shipped: a library for each level of the processor, and a manifest

numba compiles each kernel for the types that `signatures` lists. Of what it makes, the kernel's own function is kept;
a function around it unpacks arguments from the eight bytes each that `rocking.kernels.library` packs.
"""

from __future__ import annotations

import argparse
import hashlib
import json
import os
import platform
import re
import shutil
import subprocess
import sys
import sysconfig
import tempfile
from collections.abc import Collection
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parent.parent
OUT = ROOT / "build" / "shipped"

#: Levels of the processor as LLVM names them, the one that every machine has first.
LEVELS = {
    "x86_64": ["x86-64", "x86-64-v3", "x86-64-v4"],
    "amd64": ["x86-64", "x86-64-v3", "x86-64-v4"],
    "arm64": ["generic"],
    "aarch64": ["generic"],
}

#: The number of the highest level that the processor has; every library answers, and the lowest one is asked.
PROCESSOR = {
    "x86_64": """
int rocking_level(void) {
    __builtin_cpu_init();
    int third = __builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma") && __builtin_cpu_supports("bmi")
        && __builtin_cpu_supports("bmi2") && __builtin_cpu_supports("lzcnt") && __builtin_cpu_supports("f16c")
        && __builtin_cpu_supports("movbe");
    int fourth = __builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512bw")
        && __builtin_cpu_supports("avx512cd") && __builtin_cpu_supports("avx512dq")
        && __builtin_cpu_supports("avx512vl");
    return third ? (fourth ? 2 : 1) : 0;
}
""",
    "arm64": "int rocking_level(void) { return 0; }\n",
}

#: The first version of the C library for a processor. Functions of it are asked for, as if linked there, so that a
#: library serves older systems too: `exp` and its like were given new versions, which differ in how they tell errors.
FIRST_VERSION = {"x86_64": "GLIBC_2.2.5", "aarch64": "GLIBC_2.17"}

#: The oldest C library that wheels are named for, even where nothing newer than an older one is needed.
OLDEST_NAMED = 17

SUFFIX = {"darwin": ".dylib", "win32": ".dll"}.get(sys.platform, ".so")

PROCESSOR["amd64"], PROCESSOR["aarch64"] = PROCESSOR["x86_64"], PROCESSOR["arm64"]


def signatures() -> dict[str, list[tuple[Any, ...]]]:
    """Arguments as Python passes them to each kernel, by its name: of them only the types count."""
    import numpy as np

    from rocking.kernels import ground, state
    from rocking.kernels.lanes import pool_of
    from rocking.kernels.periodic import TRAP
    from rocking.kernels.sine import lanes, sequence
    from rocking.kernels.trace import Trail

    def reals(*shape: int, kind: Any = np.float64) -> Any:
        return np.ones(shape or (1,), dtype=kind)

    def given(*shape: int) -> Any:
        """Numbers that a kernel only reads: whether Python may write them does not matter."""
        array = reals(*shape)
        array.flags.writeable = False
        return array

    count = reals(1, kind=np.int64)
    flags, singles = reals(1, kind=np.bool_), reals(1, kind=np.float32)
    seen = ground.Ground(reals(3, 4), reals(1, 1, 4), 0.0, 2, 2)
    block, rules, scratch = state.record(state.BLOCK), state.record(state.RULES), state.new_scratch()
    blocks, states, table = state.records(1, state.BLOCK), state.new_states(1, 1), state.new_table(1)
    trail = Trail(seen, block, rules, state.records(1, state.NODE_ROW))
    pool = pool_of(blocks, states, 1, 1.0, 0)
    sequences = (given(), given(), given())
    statuses = reals(1, kind=np.int8)
    shares = (reals(1, 1, kind=np.float32), reals(1, 1, kind=np.float32), reals(1, 1, kind=np.float32), singles)
    return {
        "march.march": [(seen, block, rules, table, scratch, states[0])],
        "trace.trace": [(trail, scratch, given(), count, reals(1, 3))],
        "trace.vary": [(trail, scratch, state.record(state.VARIATION), 0, 0.0, reals(), reals())],
        "periodic.iterate": [(seen, block, rules, scratch, table, states, 1, reals(1, 1, 3), count)],
        "periodic.differentiate": [(trail, scratch, state.record(state.VARIATION), table, states, reals(1, 2, 2))],
        "periodic.stretch": [
            (trail, scratch, state.record(state.VARIATION), table, states[0], reals(3, 2), reals(1, 2))
        ],
        "periodic.settle": [(seen, block, rules, scratch, table, states, 1, reals(1, TRAP), count, count)],
        "periodic.to_next_impact": [(trail, scratch, state.record(state.VARIATION), table, states, reals(1, 2, 2))],
        "uplift.note_complete": [(seen, blocks, states, scratch, flags)],
        "ground.fill": [(given(3), given(2, 2), 1.0, seen, reals())],
        "lanes.run_lanes": [(seen, rules, scratch, pool, 0)],
        "lanes.march_each": [(seen, rules, scratch, pool)],
        "oscillator.peak_displacements": [(given(3), given(2, 2), given(), 0.05, reals(), reals())],
        "sine.series.eq65_time": [(1.0, 1.0, 1.0)],
        "sine.series.eq65_sums": [(1.0,)],
        "sine.series.eq65_terms": [(1.0, reals(), reals())],
        "sine.series.series_arcs": [(reals(1, 1), True, 1.0, 1.0, reals(1, 1), reals(1, 1), reals(1, 1, 1))],
        "sine.sequence.fitted_amplitudes": [(given(), given(), True, reals())],
        "population.shares": [(*shares, reals(1, 1, kind=np.float32), reals())],
        "population.log_density": [(reals(1, 1), reals(1, 1), reals(), reals())],
        "sine.arc.first_impact": [(1.0, 1.0)],
        "sine.lanes.rest_phases": [(sequences, count, np.zeros(1, lanes.GROUP), lanes.Answers(reals(), statuses))],
        "sine.sequence.rest_phase": [(1.0, 1.0, 1.0)],
        "sine.sequence.resolve": [(1.0, 1.0, 1.0, 1.0, np.zeros(1, sequence.IMPACT))],
        "sine.sequence.semianalytical_phases": [(sequences, count, reals(), statuses)],
        "sine.sequence.critical_amplitudes": [(given(), given(), reals())],
    }


def described(kind: Any) -> Any:
    """Describe a type of numba's for the manifest (see `rocking.kernels.library`)."""
    import numba.np.numpy_support as support
    from numba import types

    from rocking.kernels.library import layout

    if isinstance(kind, types.Record):
        return {"record": layout(support.as_dtype(kind))}
    if isinstance(kind, types.Array):
        if kind.layout != "C":
            raise TypeError(f"{kind} is not contiguous")
        about = {"dimensions": kind.ndim, "readonly": not kind.mutable, "aligned": kind.aligned}
        return {"items": layout(support.as_dtype(kind.dtype)), **about}
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
        from numba import types

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
        import numba.np.numpy_support as support

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


def compiled(level: str, folder: Path, names: Collection[str]) -> dict[str, list[dict[str, Any]]]:
    """Compile kernels, all by default, for a level, in a process whose numba was told so; objects go to a folder."""
    import importlib

    import llvmlite.binding as llvm
    import numba

    llvm.initialize_native_target()
    llvm.initialize_native_asmprinter()
    llvm.initialize_native_asmparser()
    target = llvm.Target.from_triple(llvm.get_process_triple())
    machine = target.create_target_machine(cpu=level, features="", opt=3, reloc="pic", codemodel="default")
    manifest: dict[str, list[dict[str, Any]]] = {}
    every = signatures()
    for name, several in every.items() if not names else ((name, every[name]) for name in names):
        module, _, function = name.rpartition(".")
        kernel = getattr(importlib.import_module(f"rocking.kernels.{module}"), function).compiled
        for number, arguments in enumerate(several):
            kinds = tuple(numba.typeof(argument) for argument in arguments)
            kernel.compile(kinds)
            made = kernel.overloads[kinds]
            symbol = f"rocking_{name.replace('.', '_')}_{number}"
            unpacking = Unpacking()
            for kind in kinds:
                unpacking.take(kind)
            returns = numbers_of(made.signature.return_type)
            around = unpacking.text(symbol, f'"{made.fndesc.llvm_func_name}"', returns)
            path = folder / f"{symbol}.o"
            path.write_bytes(object_of(made.library.get_llvm_str() + "\n" + around, symbol, machine))
            what = {"symbol": symbol, "arguments": [described(kind) for kind in kinds], "returns": returns}
            manifest.setdefault(f"rocking.kernels.{name}", []).append(what)
    return manifest


def numbers_of(returned: Any) -> list[str]:
    """List the kinds of numbers that a kernel returns."""
    from numba import types

    if isinstance(returned, types.NoneType):
        return []
    return [described(member) for member in (returned.types if isinstance(returned, types.BaseTuple) else [returned])]


def object_of(text: str, symbol: str, machine: Any) -> bytes:
    """Machine code of one function of a module, with what it calls and nothing else."""
    import llvmlite.binding as llvm

    module = llvm.parse_assembly(text)
    for each in [*module.functions, *module.global_variables]:
        if not each.is_declaration and each.name != symbol and each.linkage != llvm.Linkage.private:
            each.linkage = llvm.Linkage.internal
    builder = llvm.create_pass_builder(machine, llvm.create_pipeline_tuning_options(speed_level=3))
    passes = llvm.create_new_module_pass_manager()
    passes.add_global_dead_code_eliminate_pass()
    passes.run(module, builder)
    # A function of the C library is named as such, or as one that LLVM knows: llvm.exp.f32 calls expf.
    declared = {each.name for each in module.functions if each.is_declaration}
    known = (re.fullmatch(r"llvm\.(\w+)\.f(32|64)", name) for name in declared)
    wanted = {name for name in declared if not name.startswith("llvm.")}
    wanted |= {each[1] + ("f" if each[2] == "32" else "") for each in known if each}
    if unknown := {name for name in wanted if name.startswith(("numba", "NRT", "Py"))}:
        raise RuntimeError(f"{symbol} needs {', '.join(sorted(unknown))}, which only numba and Python have")
    if platform.libc_ver()[0] == "glibc":
        first = FIRST_VERSION[platform.machine()]
        versions = "\n".join(f'module asm ".symver {name},{name}@{first}"' for name in sorted(wanted))
        module = llvm.parse_assembly(f"{module}\n{versions}")
    code: bytes = machine.emit_object(module)
    return code


def library(level: str, out: Path, names: Collection[str] = ()) -> dict[str, Any]:
    """Compile and link the library of a level; return the manifest's part about kernels."""
    with tempfile.TemporaryDirectory() as folder:
        environment = os.environ | {"NUMBA_CPU_NAME": level, "NUMBA_CPU_FEATURES": "", "NUMBA_CACHE_DIR": folder}
        command = [sys.executable, __file__, "--level", level, "--out", folder, *names]
        subprocess.run(command, env=environment | {"ROCKING_SHIPPED": "0"}, check=True)
        source = Path(folder) / "processor.c"
        source.write_text(PROCESSOR[platform.machine().lower()], "utf-8")
        objects = sorted(str(path) for path in Path(folder).glob("*.o"))
        name = out / f"kernels-{level}{SUFFIX}"
        strip = [] if sys.platform == "darwin" else ["-Wl,--strip-all", "-Wl,-z,noexecstack"]
        subprocess.run(
            ["cc", "-O2", "-fPIC", "-shared", *strip, "-o", str(name), str(source), *objects, "-lm"], check=True
        )
        kernels: dict[str, Any] = json.loads((Path(folder) / "kernels.json").read_text("utf-8"))
    print(f"{name.name}: {name.stat().st_size / 1e6:.2f} MB, {len(objects)} functions")
    return kernels


def ship(out: Path, levels: list[str], names: Collection[str] = ()) -> None:
    """Make the libraries of some levels, the lowest first, and the manifest, unless they are there already."""
    made_from = origin(levels, names)
    files = [out / f"kernels-{level}{SUFFIX}" for level in levels]
    if is_made(out, made_from, files):
        print(f"{out}: made from these sources already")
        return
    with ThreadPoolExecutor(os.cpu_count()) as pool:
        kernels, *_ = pool.map(library, levels, [out] * len(levels), [names] * len(levels))
    libraries = {path.name: digest(path) for path in files}
    manifest = {**made_from, "platform": tag(files), "libraries": libraries, "kernels": kernels}
    (out / "manifest.json").write_text(json.dumps(manifest), "utf-8")


def origin(levels: list[str], names: Collection[str]) -> dict[str, Any]:
    """Say what libraries are made from: sources of kernels, this script, versions of the compiler, what was asked."""
    from importlib import metadata

    from rocking.kernels.library import FOLDER, sources

    versions = {name: metadata.version(name) for name in ("numba", "llvmlite")}
    return {
        "sources": sources(FOLDER.parent),
        "script": digest(Path(__file__)),
        **versions,
        "asked": [levels, [*names]],
    }


def is_made(out: Path, made_from: dict[str, Any], files: list[Path]) -> bool:
    """Whether the libraries and the manifest are there, and whole."""
    try:
        manifest = json.loads((out / "manifest.json").read_text("utf-8"))
        libraries = {path.name: digest(path) for path in files}
        return bool(manifest == {**manifest, **made_from, "libraries": libraries})
    except (OSError, ValueError, TypeError):
        return False


def digest(path: Path) -> str:
    """SHA-256 of a file."""
    return hashlib.sha256(path.read_bytes()).hexdigest()


def tag(libraries: list[Path]) -> str:
    """Name the platform as wheels do: Linux with the newest version of the C library that is needed, or a later one."""
    if platform.libc_ver()[0] == "glibc":
        needed = [int(minor) for path in libraries for minor in re.findall(rb"GLIBC_2\.(\d+)", path.read_bytes())]
        return f"manylinux_2_{max([OLDEST_NAMED, *needed])}_{platform.machine()}"
    return sysconfig.get_platform().replace("-", "_").replace(".", "_")


def main() -> None:
    """Make all libraries, or compile for one level."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--out", type=Path, default=OUT, help="folder for libraries and manifest")
    parser.add_argument("kernels", nargs="*", help="names of kernels; by default all")
    parser.add_argument("--level", help="compile for this level alone (used by the script itself)")
    options = parser.parse_args()
    if shutil.which("cc") is None:
        sys.exit("error: a C compiler (cc) links the libraries: install one, or make a wheel without them: pip wheel .")
    options.out.mkdir(parents=True, exist_ok=True)
    if options.level:
        kernels = compiled(options.level, options.out, options.kernels)
        (options.out / "kernels.json").write_text(json.dumps(kernels), "utf-8")
        return
    ship(options.out, LEVELS[platform.machine().lower()], options.kernels)


if __name__ == "__main__":
    main()
