"""The elementary functions of the parts: time of a call beside the C library's, and the worst error of many arguments.

Run by hand: ``python tests/benchmarks/elementary.py [--errors 10000000]``.  The errors are those against NumPy's
functions of 64 binary digits, in units of the last of 53.
"""

from __future__ import annotations

import ctypes
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

from gyrobench.packaging import compiler
from gyrobench.packaging.native_target import runtime_files

RANGES = {
    "sin": (-20.0, 20.0), "cos": (-20.0, 20.0), "tan": (-1.5, 1.5), "asin": (-1.0, 1.0), "atan": (-3.0, 3.0),
    "exp": (-20.0, 20.0), "log": (1e-3, 20.0), "tanh": (-3.0, 3.0),
}  # fmt: skip
IN_NUMPY = {"asin": "arcsin", "atan": "arctan"}
N, ROUNDS = 20_000, 20


def library(folder: Path) -> ctypes.CDLL:
    for name, text in runtime_files().items():
        (folder / name).write_text(text, encoding="utf-8")
    loops = [
        f"SEEN void many_{f}(const double *x, double *out, int n) {{\n"
        f"    for (int i = 0; i < n; i++) out[i] = {f}(x[i]);\n}}\n"
        for name in RANGES
        for f in (name, f"f_{name}")
    ]
    head = '#include "functions.h"\n#define SEEN __attribute__((visibility("default")))\n'
    (folder / "ask.c").write_text(head + "".join(loops), encoding="utf-8")
    compiler.compile_library(folder / "ask.c", folder / "ask.so", (folder,), compiler.this_platform())
    return ctypes.CDLL(str(folder / "ask.so"))


def main() -> None:
    rng = np.random.default_rng(1)
    with tempfile.TemporaryDirectory() as folder:
        of = library(Path(folder))

    def ask(name: str, x: np.ndarray) -> np.ndarray:
        out = np.empty_like(x)
        pointers = [a.ctypes.data_as(ctypes.POINTER(ctypes.c_double)) for a in (x, out)]
        getattr(of, f"many_{name}")(*pointers, len(x))
        return out

    for name, (low, high) in RANGES.items():
        x = rng.uniform(low, high, N)
        best = dict.fromkeys((f"f_{name}", name), np.inf)
        for _ in range(ROUNDS):
            for f in best:
                before = time.perf_counter()
                ask(f, x)
                best[f] = min(best[f], time.perf_counter() - before)
        print(name, *(f"{f} {s / N * 1e9:.1f} ns" for f, s in best.items()), flush=True)
    if "--errors" in sys.argv:
        count = int(sys.argv[sys.argv.index("--errors") + 1])
        for name, (low, high) in RANGES.items():
            worst, exact = 0.0, getattr(np, IN_NUMPY.get(name, name))
            for _ in range(max(1, count // 500_000)):
                x = rng.uniform(low, high, min(count, 500_000))
                y = ask(f"f_{name}", x)
                errors = np.abs((y - exact(x.astype(np.longdouble))) / np.spacing(np.abs(y)))
                worst = max(worst, float(errors.max()))
            print(name, f"{worst:.4f} of {count} arguments", flush=True)


if __name__ == "__main__":
    main()
