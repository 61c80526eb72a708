"""Every system as a web page in Chromium against its native FMU: size, the largest difference, time.

python tests/benchmarks/html_pages.py [--steps 100000] [system ...]

Difference: largest of any output, relative to the largest value of that output.  Time: of the steps alone in the page
against FMPy's loop with the same rows, the best of three runs of each; both have one core.  Needs ziglang and Chromium.
"""

from __future__ import annotations

import sys
import tempfile
import time
from pathlib import Path

import numpy as np
from fmpy import extract, instantiate_fmu, read_model_description

sys.path.insert(0, str(Path(__file__).parents[1] / "support"))
from asked import asked
from browser import Browser

from gyrobench.bench import Bench, standard_folder
from gyrobench.errors import GyrobenchError
from gyrobench.exchange import html_page
from gyrobench.exchange.system_fmu import export_fmu
from gyrobench.system.suite import Suite, load_test

RUNS = 3


def native(file: Path, names: list[str], rows: int, period: float) -> tuple[np.ndarray, float]:
    """Return the rows (n, outputs) of an FMU and the seconds of its steps."""
    description = read_model_description(str(file))
    references = {v.name: v.valueReference for v in description.modelVariables}
    wanted = [references[n] for n in names]
    fmu = instantiate_fmu(extract(str(file)), description, "CoSimulation")
    fmu.setupExperiment(startTime=0.0)
    fmu.enterInitializationMode()
    fmu.exitInitializationMode()
    found, began = [fmu.getReal(wanted)], time.perf_counter()
    for k in range(rows - 1):
        fmu.doStep(k * period, period)
        found.append(fmu.getReal(wanted))
    took = time.perf_counter() - began
    fmu.terminate()
    fmu.freeInstance()
    return np.array(found), took


def seconds(browser: Browser, again: int) -> float:
    """Return the seconds of the steps of the page's run; again: of another one."""
    if again:
        browser.run("void run()")
    while browser.run("document.body.dataset.run") not in ("ended", "failed"):
        time.sleep(0.1)
    return float(browser.run("document.body.dataset.milliseconds")) / 1e3


def main() -> None:
    given = asked(__doc__, "systems", steps=100_000)
    html_page.ROWS = 1000
    print(f"| system | page / kB | rows | largest difference | time / that of the FMU |\n|{'---|' * 5}")
    with tempfile.TemporaryDirectory() as name, Browser(Path(name) / "profile") as browser:
        for system_name in given.systems or sorted(Bench(standard_folder()).systems()):
            system = load_test(system_name)
            if isinstance(system, Suite):
                continue
            type(system).stop = given.steps * system.step
            page, fmu = Path(name) / f"{system_name}.html", Path(name) / f"{system_name}.fmu"
            try:
                html_page.export_page(system, page)
            except GyrobenchError as error:
                print(f"| {system_name} | {error} | | | |", flush=True)
                continue
            export_fmu(system, fmu)
            browser.open(page, 1280)
            spent = min(seconds(browser, again) for again in range(RUNS))
            count, names = browser.run("[count, content.outputs.map(o => o.name)]")
            ours = np.array(browser.run("Array.from(table().subarray(0, count * width))")).reshape(count, -1)[:, 1:]
            runs = [native(fmu, names, count, browser.run("content.every * content.step")) for _ in range(RUNS)]
            theirs, took = runs[0][0], min(took for _, took in runs)
            largest = np.abs(theirs).max(axis=0)
            worst = (np.abs(ours - theirs).max(axis=0) / np.where(largest > 0.0, largest, 1.0)).max()
            state = (
                "" if browser.run("document.body.dataset.run") == "ended" else browser.run("at('state').textContent")
            )
            size = page.stat().st_size / 1000
            print(f"| {system_name} | {size:.0f} | {count} | {worst:.1e} {state} | {spent / took:.2f} |", flush=True)
        print(f"console: {browser.console or 'nothing'}")


if __name__ == "__main__":
    main()
