"""The C compiler: the system's, or ziglang's where there is none or for another platform."""

from __future__ import annotations

import functools
import hashlib
import importlib.util
import os
import shutil
import subprocess
import sys
import sysconfig
from pathlib import Path

from gyrobench.errors import GyrobenchError

#: No vector code: these programs store numbers one by one and would wait for them when loading them in pairs.
SCALAR = ("-fno-tree-vectorize", "-fno-tree-slp-vectorize")
FLAGS = ("-O3", *SCALAR, "-std=c11", "-ffp-contract=off", "-fvisibility=hidden", "-fPIC")
WASM_FLAGS = ("-O3", "-std=c11", "-ffp-contract=off", "-fvisibility=hidden")
#: FMI 2 platform folder -> (library suffix, zig target)
PLATFORMS = {
    "linux64": (".so", "x86_64-linux-gnu.2.17"),
    "aarch64-linux": (".so", "aarch64-linux-gnu.2.17"),
    "win64": (".dll", "x86_64-windows-gnu"),
    "darwin64": (".dylib", "x86_64-macos"),
    "aarch64-darwin": (".dylib", "aarch64-macos"),
}


class CompilerError(GyrobenchError):
    """No compiler, or one that failed; the text is the compiler's own."""


def this_platform() -> str:
    """Return the FMI 2 platform name of the running interpreter."""
    machine = sysconfig.get_platform().lower()
    arm = "aarch64" in machine or "arm64" in machine
    if sys.platform == "win32":
        return "win64"
    if sys.platform == "darwin":
        return "aarch64-darwin" if arm else "darwin64"
    return "aarch64-linux" if arm else "linux64"


@functools.cache
def system_compiler() -> tuple[str, ...] | None:
    """Return ``CC``, cc, gcc or clang, the first available one; None where there is none."""
    for name in (os.environ.get("CC", ""), "cc", "gcc", "clang"):
        path = shutil.which(name) if name else None
        if path:
            return (path,)
    return None


def command(platform: str) -> tuple[str, ...] | None:
    """Return the compiler and its target options for ``platform``; None where there is none."""
    if platform == this_platform() and system_compiler():
        return system_compiler()
    if importlib.util.find_spec("ziglang"):
        return (sys.executable, "-m", "ziglang", "cc", "-target", PLATFORMS[platform][1], "-s")
    return None


@functools.cache
def identity(platform: str) -> str:
    """Return what a cached binary depends on besides its source: compiler, version, flags."""
    cc = command(platform)
    if cc is None:
        return "none"
    version = subprocess.run([*cc, "--version"], capture_output=True, text=True, check=False).stdout
    return hashlib.sha256(repr((cc[1:], version.splitlines()[:1], FLAGS)).encode()).hexdigest()[:16]


def compile_library(
    source: Path, output: Path, includes: tuple[Path, ...], platform: str, objects: tuple[Path, ...] = ()
) -> None:
    """Compile one C file, with objects, to a shared library.  Raises CompilerError with the compiler's message."""
    math = () if platform.startswith("win") else ("-lm",)
    _compile(source, output, includes, platform, "-shared", *map(str, objects), *math)


def compile_object(source: Path, output: Path, includes: tuple[Path, ...], platform: str) -> None:
    """Compile one C file of a library that has others, which then is APART.  Raises CompilerError."""
    _compile(source, output, includes, platform, "-DAPART", "-c")


def compile_wasm(source: Path) -> bytes:
    """Return a C file as WebAssembly that asks its host for nothing.  Raises CompilerError, also without ziglang."""
    if not importlib.util.find_spec("ziglang"):
        raise CompilerError("a page that runs needs ziglang's compiler: `pip install gyrobench[cross]`")
    output = source.with_suffix(".wasm")
    cc = (sys.executable, "-m", "ziglang", "cc", "-target", "wasm32-wasi", "-mexec-model=reactor", "-s", "-w")
    done = subprocess.run(
        [*cc, *WASM_FLAGS, str(source), "-o", str(output)], capture_output=True, text=True, check=False
    )
    if done.returncode:
        raise CompilerError(f"{source.name}: the C compiler failed:\n{done.stderr.strip()}")
    return output.read_bytes()


def _compile(source: Path, output: Path, includes: tuple[Path, ...], platform: str, *more: str) -> None:
    cc = command(platform)
    if cc is None:
        raise CompilerError(
            f"no C compiler for {platform}: install one (cc, gcc or clang), or `pip install gyrobench[cross]`"
        )
    args = [*cc, *FLAGS, *(f"-I{i}" for i in includes), str(source), "-o", str(output), *more]
    done = subprocess.run(args, capture_output=True, text=True, check=False)
    if done.returncode:
        raise CompilerError(f"{source.name}: the C compiler failed:\n{done.stderr.strip()}")
