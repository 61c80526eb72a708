"""The polar servo test as it is done: 24 h in each mount and the two dwells, as a full dynamic co-simulation.

    python tests/benchmarks/servo_day.py [--step 1e-4] [--mounts "S N"] [--built] [--resume] [--out FOLDER] [--write]

Noise, encoder errors (0.5 arcsec once and twice a turn, 0.2 arcsec fine) and quantum (0.18 arcsec) are on.  Prints wall
time, CPU time (the machine may be shared), largest memory, and each coefficient against its truth.  With ``--resume``
the run is made a second time, stopped in the middle and continued, and the records are compared bit for bit.
``--built``: on the table as it is built (encoder, sampled controller; no fine error of the scale).
"""

from __future__ import annotations

import argparse
import os
import resource
import tempfile
import time
from pathlib import Path

import quoted

from gyrobench.engine.run_errors import RunError
from gyrobench.engine.session import run
from gyrobench.record.record import Record
from gyrobench.system.system import load_system

NAME = "servo_polar"
ENCODER = {
    "table.quantum": "0.18arcsec",
    **{f"table.encoder_amplitude[{k}]": size for k, size in ((1, "0.5arcsec"), (2, "0.5arcsec"), (3, "0.2arcsec"))},
}

SCALE = {f"table.scale_{name}": "0.5arcsec" for name in ("eccentricity", "tilt")}


def timed(
    what: str, values: dict[str, str], step: float, out: Path, write: bool = False, **how: object
) -> Record | None:
    wall, cpu = time.perf_counter(), sum(os.times()[:4])
    try:
        record = run(NAME, values=values, step=step, seed=3, out=out, **how)  # type: ignore[arg-type]
    except RunError as stopped:
        record = None
        what += f" ({str(stopped).splitlines()[0]})"
    wall, cpu = time.perf_counter() - wall, sum(os.times()[:4]) - cpu  # the run happens in a child process
    memory = max(resource.getrusage(who).ru_maxrss for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN)) / 1024
    steps = f", {record.run.steps} steps" if record is not None else ""
    print(f"{what}: wall {wall:.0f} s, CPU {cpu:.0f} s{steps}, {memory:.0f} MB", flush=True)
    if write:
        unit = f"s of CPU, {NAME}, 24 h in two orientations at {step * 1e3:g} ms, linked form"
        quoted.record("speed.servo_day", f"{cpu:.0f}", unit, "tests/benchmarks/servo_day.py")
        quoted.record("speed.servo_day_memory", f"{memory:.0f}", "MB, the same", "tests/benchmarks/servo_day.py")
    return record


def main() -> None:
    ask = argparse.ArgumentParser()
    ask.add_argument("--step", type=float, default=1e-4, help="coupling step, s")
    ask.add_argument("--mounts", default="S N")
    ask.add_argument("--built", action="store_true", help="on table_servo_dynamic")
    ask.add_argument("--resume", action="store_true")
    ask.add_argument("--out", type=Path)
    ask.add_argument("--write", action="store_true", help="write docs/figures.toml: of the default test")
    asked = ask.parse_args()
    if asked.write and (asked.built or asked.mounts != "S N" or asked.step != 1e-4):
        ask.error("--write is of the default test")
    out = asked.out or Path(tempfile.mkdtemp(prefix="gyrobench-day-"))
    route = "dwells" if len(asked.mounts.split()) == 2 else "combination"
    values = {"mounts": asked.mounts, "route": route, **(SCALE if asked.built else ENCODER)}
    parts = {"table": "table_servo_dynamic"} if asked.built else {}
    whole = timed(f"{asked.mounts} at {asked.step:g} s", values, asked.step, out / "whole", asked.write, parts=parts)
    assert whole is not None
    result = load_system(NAME).reduce(whole)
    for c in result.coefficients:
        print(f"  {c.name:12} {c.estimate:+.6f} u {c.u:.6f} {c.unit}" + ("" if c.z is None else f"  z {c.z:+.2f}"))
    if asked.resume:
        middle = float(whole.windows["t_end"][-1]) / 2.0 + 0.0123
        timed("first half", values, asked.step, out / "halves", stop_at=middle, parts=parts)
        again = timed("continued", values, asked.step, out / "halves", resume=True, parts=parts)
        assert again is not None
        print(f"continued at {again.run.resumed_at} s; records bit-equal: {again.same_data(whole)}")


if __name__ == "__main__":
    main()
