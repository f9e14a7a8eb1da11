"""Make libraries of compiled kernels for this platform: a wheel that is built next holds them.

python scripts/ship_kernels.py            # build/shipped: a library for each level of the processor, and a manifest

numba brings each kernel into LLVM's language for the types that `rocking.kernels.signatures` lists, once; all of them
are then optimised together for each level, so that what several kernels call is in a library once. A function around
each kernel unpacks arguments from the eight bytes each that `rocking.kernels.library` packs.
"""

from __future__ import annotations

import argparse
import hashlib
import json
import os
import platform
import re
import shlex
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

#: The oldest macOS that libraries are linked and wheels are named for: the first on arm64.
OLDEST_MACOS = "11.0"

#: What links the libraries.
LINKER = shlex.split(os.environ.get("CC") or "cc")

SUFFIX = {"darwin": ".dylib", "win32": ".dll"}.get(sys.platform, ".so")

PROCESSOR["amd64"], PROCESSOR["aarch64"] = PROCESSOR["x86_64"], PROCESSOR["arm64"]


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


def lower(names: Collection[str], folder: Path) -> None:
    """Write kernels in LLVM's language, with all that they call and not optimised yet; in a process for this alone.

    To the folder go their code, that of the functions around them, and the manifest's part about them.
    """
    import llvmlite.binding as llvm
    import numba

    from rocking.kernels import compiler
    from rocking.kernels.signatures import named, signatures

    module, linked, around = llvm.parse_assembly(""), set(), []
    manifest: dict[str, list[dict[str, Any]]] = {}
    every = signatures()
    # A part is kept as it is before it is optimised; a kernel may call another one.
    parts = {name: compiler.part_of(named(name).py_func, None, inline=False) for name in every}
    for name, part in parts.items():
        if not isinstance(part, compiler.Part):
            raise RuntimeError(f"numba {numba.__version__} lacks members of its libraries that this script needs")
        vars(named(name))["compiled"] = part
    for name in names or every:
        part = parts[name]
        for number, arguments in enumerate(every[name]):
            kinds = tuple(numba.typeof(argument) for argument in arguments)
            part.dispatcher.compile(kinds)
            made = part.dispatcher.overloads[kinds]
            # What nothing refers to so far is dropped by linking: a kernel comes before its parts.
            module.link_in(llvm.parse_assembly(made.library.get_llvm_str()))
            for needed in made.library.with_needed()[1:]:
                if needed not in linked:
                    module.link_in(needed._get_module_for_linking(), preserve=True)
                    linked.add(needed)
            symbol = f"rocking_{name.replace('.', '_')}_{number}"
            unpacking = Unpacking()
            for kind in kinds:
                unpacking.take(kind)
            returns = numbers_of(made.signature.return_type)
            around.append(unpacking.text(symbol, f'"{made.fndesc.llvm_func_name}"', returns))
            what = {"symbol": symbol, "arguments": [described(kind) for kind in kinds], "returns": returns}
            manifest.setdefault(f"rocking.kernels.{name}", []).append(what)
    (folder / "kernels.ll").write_text(str(module), "utf-8")
    (folder / "around.ll").write_text("\n".join(around), "utf-8")
    (folder / "kernels.json").write_text(json.dumps(manifest), "utf-8")


def optimise(level: str, folder: Path) -> None:
    """Write machine code of what `lower` has written, optimised for a level as numba does it there."""
    import llvmlite.binding as llvm
    from numba.core.codegen import AOTCPUCodegen
    from numba.core.compiler_lock import global_compiler_lock

    llvm.initialize_native_asmparser()
    made = AOTCPUCodegen("rocking", level).create_library("kernels")
    with global_compiler_lock:
        made.add_llvm_module(llvm.parse_assembly((folder / "kernels.ll").read_text("utf-8")))
        made.finalize()
    target = llvm.Target.from_triple(llvm.get_process_triple())
    machine = target.create_target_machine(cpu=level, features="", opt=3, reloc="pic", codemodel="default")
    around = (folder / "around.ll").read_text("utf-8")
    (folder / f"{level}.o").write_bytes(object_of(f"{made.get_llvm_str()}\n{around}", machine))


def numbers_of(returned: Any) -> list[str]:
    """List the kinds of numbers that a kernel returns."""
    from numba import types

    if isinstance(returned, types.NoneType):
        return []
    return [described(member) for member in (returned.types if isinstance(returned, types.BaseTuple) else [returned])]


def object_of(text: str, machine: Any) -> bytes:
    """Machine code of the functions of a module that are named as kernels are, with what they call and nothing else."""
    import llvmlite.binding as llvm

    module = llvm.parse_assembly(text)
    for each in [*module.functions, *module.global_variables]:
        if not (each.is_declaration or each.name.startswith("rocking_") or each.linkage == llvm.Linkage.private):
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
    if unknown := {name for name in wanted if name.startswith(("numba", "NRT", "Py", "_ZN"))}:
        raise RuntimeError(f"kernels need {', '.join(sorted(unknown))}, which only numba and Python have")
    if platform.libc_ver()[0] == "glibc":
        first = FIRST_VERSION[platform.machine()]
        versions = "\n".join(f'module asm ".symver {name},{name}@{first}"' for name in sorted(wanted))
        module = llvm.parse_assembly(f"{module}\n{versions}")
    code: bytes = machine.emit_object(module)
    return code


def library(level: str, folder: Path, out: Path) -> None:
    """Compile and link the library of a level of what `lower` has written to a folder."""
    subprocess.run([sys.executable, __file__, "--level", level, "--folder", str(folder)], check=True)
    source = folder / f"{level}.c"
    source.write_text(PROCESSOR[platform.machine().lower()], "utf-8")
    name = out / f"kernels-{level}{SUFFIX}"
    linking = ["-Wl,--strip-all", "-Wl,-z,noexecstack"]
    if sys.platform == "darwin":
        linking = [f"-mmacosx-version-min={OLDEST_MACOS}"]
    made = [str(name), str(source), str(folder / f"{level}.o")]
    subprocess.run([*LINKER, "-O2", "-fPIC", "-shared", *linking, "-o", *made, "-lm"], check=True)
    print(f"{name.name}: {name.stat().st_size / 1e6:.2f} MB")


def ship(out: Path, levels: list[str], names: Collection[str] = ()) -> None:
    """Make the libraries of some levels, the lowest first, and the manifest, unless they are there already."""
    made_from = origin(levels, names)
    files = [out / f"kernels-{level}{SUFFIX}" for level in levels]
    if is_made(out, made_from, files):
        print(f"{out}: made from these sources already")
        return
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        # What numba compiles for itself beside the kernels runs on every processor, too.
        least = {"NUMBA_CPU_NAME": levels[0], "NUMBA_CPU_FEATURES": "", "NUMBA_CACHE_DIR": name}
        subprocess.run([sys.executable, __file__, "--folder", name, *names], env=os.environ | least, check=True)
        with ThreadPoolExecutor(os.cpu_count()) as pool:
            list(pool.map(library, levels, [folder] * len(levels), [out] * len(levels)))
        kernels = json.loads((folder / "kernels.json").read_text("utf-8"))
    libraries = {path.name: digest(path) for path in files}
    manifest = {**made_from, "platform": tag(files), "libraries": libraries, "kernels": kernels}
    (out / "manifest.json").write_text(json.dumps(manifest), "utf-8")


def origin(levels: list[str], names: Collection[str]) -> dict[str, Any]:
    """Say what libraries are made from: sources of kernels, this script, versions of the compiler, what was asked."""
    from importlib import metadata

    from rocking.kernels.library import FOLDER
    from rocking.kernels.sources import sources

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
    if sys.platform == "darwin":  # Python itself may be for two processors; a library is for one
        return f"macosx_{OLDEST_MACOS.replace('.', '_')}_{platform.machine()}"
    return sysconfig.get_platform().replace("-", "_").replace(".", "_")


def main() -> None:
    """Make all libraries, or compile for one level."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--out", type=Path, default=OUT, help="folder for libraries and manifest")
    parser.add_argument("kernels", nargs="*", help="names of kernels; by default all")
    parser.add_argument("--folder", type=Path, help="do one step with it (used by the script itself)")
    parser.add_argument("--level", help="that for this level")
    options = parser.parse_args()
    if shutil.which(LINKER[0]) is None:
        sys.exit(
            f"error: a C compiler ({LINKER[0]}; CC names another) links the libraries: install one, or make a wheel "
            "without them: pip wheel ."
        )
    if options.level:
        optimise(options.level, options.folder)
        return
    if options.folder:
        lower(options.kernels, options.folder)
        return
    options.out.mkdir(parents=True, exist_ok=True)
    ship(options.out, LEVELS[platform.machine().lower()], options.kernels)


if __name__ == "__main__":
    main()
