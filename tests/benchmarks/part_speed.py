"""Time of one communication step of 1 ms of every native part: set inputs, step, get outputs.

Run by hand: ``python tests/benchmarks/part_speed.py [--write] [--quick] [part ...]``.  Parameters (noise on) and inputs
are those of the parts' reference runs, repeated; --quick: without flicker.  The processor time of the best of many
short rounds counts: the machine may be shared.  --write: mean, median and counts of all parts into docs/figures.toml.
"""

from __future__ import annotations

import ctypes
import statistics
import sys
import tempfile
from dataclasses import replace
from pathlib import Path

import quoted

from gyrobench.bench import Bench, standard_folder
from gyrobench.packaging import build, compiler
from gyrobench.packaging.instance import Fmu
from gyrobench.packaging.reference import Reference, read_reference

STEPS = 20_000
ROUNDS = 100
LONGEST = 4.0  # s of rounds, beyond which no other one begins
CARRIERS = ("gyro_vibratory_carrier",)  # hundreds of internal steps in 1 ms, by their purpose: not in the mean
H = 1e-3


def driver(folder: Path) -> ctypes.CDLL:
    source = Path(__file__).with_suffix(".c")
    compiler.compile_library(source, folder / "driver.so", (folder,), compiler.this_platform())
    return ctypes.CDLL(str(folder / "driver.so"))


def measure(library: ctypes.CDLL, part: str, out: Path, quick: bool = False) -> float | None:
    """Seconds a step, of 1 ms or, where the part refuses that, of the length in its reference run; None, said, where it
    refuses the repetition of its inputs.
    """
    reference = read_reference(Bench(standard_folder()).part_folder(part) / "reference.csv")
    if quick:
        quiet = {n: 0.0 for n in reference.parameters if "flicker" in n and not n.endswith("_tau")}
        reference = replace(reference, parameters={**reference.parameters, **quiet})
    try:
        return measure_at(H, reference, library, part, out)
    except RuntimeError as refused:
        if not reference.step < H:
            print(f"not measured: {refused}")
            return None
        print(f"{part}: steps of {reference.step * 1e3:g} ms")
        return measure_at(reference.step, reference, library, part, out)


def measure_at(h: float, reference: Reference, library: ctypes.CDLL, part: str, out: Path) -> float:
    """Seconds a step of h (s).  Raises RuntimeError where the part refuses it."""
    one = Fmu(build(part, out=out), part)
    one.set(reference.parameters)
    one.set({n: x[0] for n, x in reference.inputs.items()})
    one.initialize()
    names = list(reference.inputs)
    rows = len(reference.time)
    flat = [reference.inputs[n][k] for k in range(rows) for n in names]
    inputs = (ctypes.c_double * max(1, len(flat)))(*flat)
    ins = (ctypes.c_uint * max(1, len(names)))(*(one.variables[n].valueReference for n in names))
    outs = (ctypes.c_uint * len(reference.outputs))(*(one.variables[n].valueReference for n in reference.outputs))
    values = (ctypes.c_double * len(outs))()
    functions = [
        ctypes.cast(getattr(one.fmu.dll, f"fmi2{n}"), ctypes.c_void_p) for n in ("SetReal", "GetReal", "DoStep")
    ]
    size, double, long = ctypes.c_size_t, ctypes.c_double, ctypes.c_long
    library.time_steps.restype = double
    best, spent = float("inf"), 0.0
    for k in range(ROUNDS):
        seconds = library.time_steps(
            ctypes.c_void_p(one.fmu.component), *functions, ins, size(len(names)), inputs, size(rows),
            outs, size(len(outs)), values, double(h), long(k * STEPS), long(STEPS),
        )  # fmt: skip
        if seconds < 0.0:
            raise RuntimeError(f"{part}: status {-seconds:g}: {'; '.join(one.messages)}")
        best = min(best, seconds / STEPS)
        spent += seconds
        if spent > LONGEST:
            break
    one.free()
    return best


def write(times: list[float]) -> None:
    """Write what the pages quote, of the times of all parts, s."""
    found = {
        "mean": (f"{1e6 * statistics.mean(times):.2f}", "µs a step of 1 ms, mean of the native parts"),
        "median": (f"{1e6 * statistics.median(times):.2g}", "µs, median"),
        "quick": (str(sum(t < 0.2e-6 for t in times)), "parts below 0.2 µs"),
        "count": (str(len(times)), "parts measured"),
    }
    for name, (value, unit) in found.items():
        quoted.record(f"speed.part_{name}", value, unit, "tests/benchmarks/part_speed.py")


def main(words: list[str]) -> None:
    parts = [w for w in words if not w.startswith("--")]
    if "--write" in words and words != ["--write"]:
        sys.exit("--write is of all parts, as they are")
    with tempfile.TemporaryDirectory() as folder:
        library = driver(Path(folder))
        print(f"{'part':20} us a step of 1 ms")
        times = []
        known = Bench(standard_folder()).parts()
        for part in parts or sorted(n for n, f in known.items() if (f / "reference.csv").exists()):
            if (seconds := measure(library, part, Path(folder), "--quick" in words)) is not None:
                if part not in CARRIERS:
                    times.append(seconds)
                print(f"{part:20} {seconds * 1e6:.4f}", flush=True)
        if times:
            print(f"{'mean':20} {sum(times) / len(times) * 1e6:.4f}   (budget 0.06, each part 0.2)")
    if "--write" in words:
        write(times)


if __name__ == "__main__":
    main(sys.argv[1:])
