"""All systems in other tools, compared after reduction: simulate_ssp of FMPy, libcosim, ecos, container and one FMU.

    python tests/benchmarks/matrix.py [--out FILE] [system ...]       # then the table:
    python tests/benchmarks/matrix.py --table FILE

Plans are short, noise is off where a system measures anything else than its noise.  A container and the one FMU, both
in FMPy, must give the bench's record bit for bit.  The others couple all parts in parallel: each wire is a step late.
With m(h) a measure at the step h, what the step does to it is 2 (m(h) - m(h/2)) + O(h^2); the report of the bench
states it, and for libcosim it is found in the same way.  The difference of the two at h must be that of these two
effects; "left" is what they leave, over their sum.  ecos and FMPy are compared with libcosim at h.  All differences are
over u, the standard uncertainty of the measure in a run of the bench with noise on the same plan (the largest measure
of the unit where there is none).
"""

from __future__ import annotations

import json
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

sys.path.insert(0, str(Path(__file__).parents[1] / "support"))

from asked import asked
from exported import NOISY, at_step, differences, effects, left_over, names_of, numbers, record_in, same, scales
from masters import PeerError, run_in

from gyrobench.bench import Bench, standard_folder
from gyrobench.engine.session import run
from gyrobench.errors import GyrobenchError
from gyrobench.exchange.container import export_container
from gyrobench.exchange.ssp_export import export_ssp
from gyrobench.exchange.system_fmu import export_fmu
from gyrobench.system.suite import Suite, load_test

W = 7.2921159e-5  # rad/s
#: plans in which every tool comes to an end, and the step where it is not the system's own
# fmt: off
PLANS: dict[str, tuple[dict[str, Any], float | None]] = {
    "accelerometer_four": ({"points": 16, "dwell": 0.5, "settle": 0.5}, None),
    "accelerometer_multipoint": ({"points": 8, "dwell": 0.5, "settle": 0.5}, None),
    "angle_system_test": ({"positions": 30, "rates": "200 1000", "travel": 0.1}, None),
    "attitude_estimator": ({"rest": 20.0, "cycles": 4, "time": 20.0}, None),
    "drift_compensation": ({"records": 8}, None),
    "drift_record": ({"duration": 60.0, "window": 0.1, "settle": 1.0}, 2e-3),
    "eight_position": ({"cycles": 2, "readings": 2, "dwell": 1.0, "settle": 1.0}, None),
    "estimator_bench": ({"samples": 13000}, None),
    "fixed_position": ({"readings": 8, "dwell": 8.0, "settle": 1.0}, None),
    "gimbal_stabilization": ({"sweeps": False, "base": 0.0, "ride": 36.0}, 5e-4),
    "gimbal_tracking": ({"sweeps": False, "base": 0.0, "acquire": 0.0, "ride": 36.0}, 5e-4),
    "gyro_magnetic_compass": ({}, 1.0),
    "gyrocompass": ({"phases": "settling undamped"}, 1.0),
    "north_finder": ({"time": 14.0, "heading": 1.745329, "windows": 8}, None),
    "open_loop_drift": ({"pairs": 4, "wait": 2.0, "dwell": 0.1}, None),
    "pickoff_scale_factor": ({"points": 10}, 5e-4),
    "platform_alignment": ({"crossover": 2.5}, 5e-3),
    "platform_four_gimbal": ({"hold": 1.0}, 1e-3),
    "platform_single_axis": ({"hold": 10.0}, 1e-3),
    "platform_three_axis": ({"sweeps": False, "hold": 5.0, "swing": 0.0}, 5e-4),
    "platform_three_gimbal": ({"hold": 1.0}, 1e-3),
    "rebalance_loop_test": ({"rates": "0.3 0.6 1", "gate": 0.2, "rest": 6, "readings": 3, "settle": 1.0}, None),
    "servo_polar": (
        {"site.earth_rate": 1e3 * W, "time": 86.2, "window": 2.4, "dwell": 24.0, "settle": 2.0, "cage.i_max": 2.0},
        2e-3,
    ),
    "servo_two_axis": (
        {
            "site.earth_rate": 500 * W, "time": 172.8, "window": 4.8, "settle": 2.0, "cage_x.i_max": 10.0,
            "cage_y.i_max": 10.0,
        },
        5e-4,
    ),
    "servo_vertical_level": ({"dwell": 5.0, "cycles": 1, "settle": 1.0}, None),
    "stabilizer_floated_2dof": ({"hold": 1.0}, 1e-3),
    "stabilizer_power_2dof": ({"hold": 1.0}, 2e-3),
    "stabilizer_sdf": ({"time": 10.0, "command": 1e-4}, None),
    "table_capture": ({}, 4e-4),
    "table_environment": ({"dwell": 240.0, "readings": 40, "settle": 1.0}, 5e-3),
    "table_motor_test": ({"coast": 0.5}, 5e-4),
    "table_position_test": ({"move_rate": "8deg/s", "settle": "0.5s", "dwell": "0.3s", "mounts": "0 30"}, 2.5e-3),
    "table_rate_test": ({"rates": "100 999.99", "dwell": 5.0, "least": 20, "settle": 1.0}, None),
    "table_servo_loop": ({"hold": 1.0}, 2.5e-4),
    "table_supervision": ({"repeats": 1, "pairs": 0, "quiet": 10.0}, None),
    "test_start_up": ({"dwell": 6.0}, None),
    "vertical_gyro": ({"time": 20.0}, None),
    "torquer_scale_factor": ({"currents": "20 60 100", "range": "0.5deg", "range_large": "2deg", "windows": 5}, None),
    "tumble_single_axis": (
        {
            "rate": "6000 ERU", "dwell": 3.0, "settle": 0.8, "windows": 12, "table.acceleration": 0.4,
            "rebalance.resolution": 0.0,
        },
        None,
    ),
    "tumble_two_axis": (
        {
            "positions": 25, "dwell": 0.5, "settle": 1.0, "inner_rate": 1.0, "rebalance.i_max": 50.0,
            "table.index_rate[1]": 1.0, "table.acceleration": [1.0, 1.0],
        },
        None,
    ),
    "tumble_two_channel": (
        {
            "rate": "6000 ERU", "windows": 24, "dwell": 3.0, "settle": 0.8, "table.acceleration": 0.4,
        },
        2e-3,
    ),
}
# fmt: on
SLOW = 16_000  # steps beyond which FMPy's simulate_ssp, 0.3 to 2 ms a step, runs 20 steps: whether it starts
ONE, CONTAINER, LIBCOSIM, ECOS, FMPY = "one FMU", "container", "libcosim", "ecos", "FMPy simulate_ssp"


def row(name: str) -> dict[str, Any]:
    """Return what was found for a system: by tool "=", a difference over u, or why there is none."""
    values, step = PLANS.get(name, ({}, None))
    system = at_step(name, values, step)
    h = system.step
    half = at_step(name, values, h if name in NOISY else h / 2)
    with tempfile.TemporaryDirectory() as folder_name:
        folder = Path(folder_name)
        own = run(system)
        own_half = own if name in NOISY else run(half)
        result = system.reduce(own)
        ours, scale = numbers(result), scales(result, at_step(name, values, step, noise=True))
        own_effects = {} if name in NOISY else effects(result, half.reduce(own_half))
        found: dict[str, Any] = {
            "system": name,
            "step": h,
            "steps": round(float(own.run.stopped_at or 0.0) / h),
            "measures": len(ours),
            "own effect": max((abs(e) / scale[n] for n, e in own_effects.items() if n in scale), default=0.0),
        }

        def tried(tool: str, of: Callable[[], Any]) -> None:
            try:
                found[tool] = of()
            except (PeerError, GyrobenchError, ArithmeticError, KeyError, IndexError) as error:
                found[tool] = f"{type(error).__name__}: {error}"

        def one_fmu(tool: str, write: Callable[..., Any]) -> Any:
            write(system, folder / f"{tool}.fmu")
            record, _ = record_in("FMU in FMPy", folder / f"{tool}.fmu", system, own)
            return "=" if same(record, own) else differences(numbers(system.reduce(record)), ours, scale)

        tried(CONTAINER, lambda: one_fmu(CONTAINER, export_container))
        tried(ONE, lambda: one_fmu(ONE, export_fmu))
        export_ssp(system, folder / "h.ssp")
        if name not in NOISY:
            export_ssp(half, folder / "half.ssp")
        reference = ours

        def libcosim() -> Any:
            nonlocal reference
            record, seconds = record_in("libcosimpy", folder / "h.ssp", system, own)
            of_tool = system.reduce(record)
            reference = numbers(of_tool)
            found["us"] = round(1e6 * seconds, 1)
            if name not in NOISY:
                at_half, _ = record_in("libcosimpy", folder / "half.ssp", half, own_half)
                found["left"] = left_over(ours, own_effects, reference, effects(of_tool, half.reduce(at_half)), scale)
            return differences(reference, ours, scale)

        def parallel(tool: str) -> Any:
            record, _ = record_in(tool, folder / "h.ssp", system, own)
            return differences(numbers(system.reduce(record)), reference, scale)

        tried(LIBCOSIM, libcosim)
        tried(ECOS, lambda: parallel("ecospy"))
        if found["steps"] > SLOW:
            tried(FMPY, lambda: run_in("FMPy simulate_ssp", folder / "h.ssp", names_of(system), h, 20) and None)
        else:
            tried(FMPY, lambda: parallel("FMPy simulate_ssp"))
    return found


def cell(found: Any) -> str:
    if isinstance(found, list):
        return f"{found[0]:.0e}" if found[0] else "="
    return "too slow" if found is None else str(found) if found == "=" else "no"


def table(rows: list[dict[str, Any]]) -> str:
    """Return the table in Markdown."""
    head = ["system", "steps of h", "measures", "effect of h", LIBCOSIM, "left", ECOS, FMPY, CONTAINER, ONE]
    lines = ["| " + " | ".join(head) + " |", "|" + "---|" * len(head)]
    for r in sorted(rows, key=lambda r: str(r["system"])):
        plan = f"{r['steps']} of {r['step']:g} s"
        left = f"{r['left'][0]:.2f}" if "left" in r else ""
        effect = f"{r['own effect']:.1e}" if r["own effect"] else ""
        cells = [r["system"], plan, r["measures"], effect, cell(r[LIBCOSIM]), left, *(cell(r.get(t)) for t in head[6:])]
        lines.append("| " + " | ".join(map(str, cells)) + " |")
    return "\n".join(lines)


def main() -> None:
    given = asked(
        __doc__, "systems", out=(Path, "a line of JSON for each system, appended"),
        table=(Path, "print the table of such a file"),
    )  # fmt: skip
    if given.table:
        print(table([json.loads(line) for line in given.table.read_text(encoding="utf-8").splitlines()]))
        return
    for name in given.systems or sorted(Bench(standard_folder()).systems()):
        if isinstance(load_test(name), Suite):
            continue
        began = time.perf_counter()
        found = row(name)
        found["seconds"] = round(time.perf_counter() - began, 1)
        line = json.dumps(found, ensure_ascii=False)
        print(line, flush=True)
        if given.out:
            with given.out.open("a", encoding="utf-8") as file:
                file.write(line + "\n")


if __name__ == "__main__":
    main()
