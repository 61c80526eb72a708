"""Every system as one FMU in FMPy: validated, and its first steps compared with the bench's own run bit for bit.

python tests/benchmarks/system_fmus.py [--steps 1000] [--fmi 2|3 | --container] [system ...]
"""

from __future__ import annotations

import tempfile
import time
from pathlib import Path

import numpy as np
from asked import asked
from fmpy import simulate_fmu
from fmpy.validation import validate_fmu

from gyrobench.bench import Bench, standard_folder
from gyrobench.engine.session import Session
from gyrobench.exchange.container import export_container
from gyrobench.exchange.system_fmu import export_fmu
from gyrobench.system.suite import Suite, load_test


def main() -> None:
    given = asked(
        __doc__, "systems", steps=1000, fmi=2, container=(False, "a container of the FMUs in place of the native FMU")
    )
    worse = 0
    for name in given.systems or sorted(Bench(standard_folder()).systems()):
        if isinstance(load_test(name), Suite):
            continue
        with tempfile.TemporaryDirectory() as folder, Session(name) as session:
            system, file, began = session.system, Path(folder) / f"{name}.fmu", time.process_time()
            for attribute, value in {"stop": given.steps * system.step, "channel_period": system.step}.items():
                setattr(type(system), attribute, value)  # before the export: plans may follow the period
            if given.container:
                export_container(system, file)
            else:
                export_fmu(system, file, fmi=given.fmi)
            problems = list(validate_fmu(str(file)))
            own = session.run().channels
            wanted = [channel for channel in own if channel != "time"]  # locals of a container among them
            times = {"stop_time": given.steps * system.step, "output_interval": system.step, "step_size": system.step}
            found = simulate_fmu(str(file), output=wanted, **times)
            for channel in wanted:
                if not np.array_equal(found[channel][: len(own["time"])], own[channel]):
                    problems.append(f"{channel} differs")
            size, took = file.stat().st_size / 1024, time.process_time() - began
        worse += bool(problems)
        told = "; ".join(problems) or f"{len(own) - 1} channels bit-equal over {given.steps} steps"
        print(f"{name:28} {size:5.0f} kB {took:5.1f} s  {told}", flush=True)
    raise SystemExit(1 if worse else 0)


if __name__ == "__main__":
    main()
