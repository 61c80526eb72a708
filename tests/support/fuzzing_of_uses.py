"""Further kinds of :mod:`fuzzing`: stored files, campaigns, calls from Python, files of users, surroundings."""

from __future__ import annotations

import contextlib
import datetime
import json
import os
import random
import shutil
import subprocess
import sys
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np
from fuzzing import CORPUS, REDUCED, changed

from gyrobench.errors import GyrobenchError

#: values of every type, for what takes some of them
ODD: list[Any] = [
    None, True, 0, -1, 3, 10**30, 2.5, float("nan"), float("inf"), 1e308, "", "x", "\0", "a" * 5000, "45.75deg", "../x",
    b"x", [], [1, 2], ["a", 3], [[[]]], {}, {"a": 1}, {1: 2}, {"gyro": 3}, {"latitude": "0deg..80deg:999999999"},
    (1, 2), {1, 2}, 3 + 4j, object(), print, int, range(3), datetime.date(2026, 1, 1), Path("nothing"), np.float64(3.0),
    np.arange(3), np.array(["a"]), 10_000_000_000,
]  # fmt: skip


def _campaign(folder: Path) -> Callable[[random.Random], object]:
    """Definitions of campaigns: bytes and tokens of the file, and values of other types."""
    from gyrobench.campaign.execution.campaign_plan import make_plan
    from gyrobench.campaign.execution.definition import from_mapping, read_definition

    text = (
        b'name = "lot"\nquestion = "why"\nsystem = "fixed_position"\nseeds = 2\nkeep = "failures"\nruns = 4\n'
        b'design = "lhs"\ndesign_seed = 3\ntime_limit = "1h"\nmemory_limit = "500MB"\nretries = 1\nstep = "1ms"\n'
        b'check_step = false\ntable = "t.csv"\n[set]\nlatitude = "45.75deg"\nheight = 12.5\n[set.gyro]\n'
        b'white = [1e-9, 2e-9]\n[over]\ndwell = "10s..60s:3"\n"gyro.D_I" = "uniform(-1, 1) deg/h/g"\n'
        b'"gyro.D_O" = [0.1, "0.3 deg/h/g"]\nearth_rate = "0.1,0.3,1 deg/h"\n[parts]\ngyro = ["floated_gyro"]\n'
        b'[maps]\ngyro = "m.toml"\n[arguments]\nn = 3\n'
    )
    (folder / "t.csv").write_text("gyro.D_F [deg/h],seed\n0.1,1\n0.2,2\n")
    keys = [line.split(b"=")[0].strip().decode() for line in text.splitlines()[:14]]
    file = folder / "campaign.toml"

    def one(rng: random.Random) -> None:
        if rng.random() < 0.7:
            file.write_bytes(changed(text, rng))
            asked = read_definition(file)
        else:
            content = {"system": "fixed_position", "over": {"dwell": "10s..60s:3"}}
            for _ in range(rng.randint(1, 3)):
                content[rng.choice([*keys, "set", "over", "parts", "maps", "data"])] = rng.choice(ODD)
            asked = from_mapping(content, folder)
        asked.as_given()
        if rng.random() < REDUCED:
            make_plan(asked)
            return
        axes, distributions = asked.axes(["gyro", "table"])
        [a.as_dict() for a in axes], asked.fixed_parts(["gyro"]), asked.seed_list(), asked.files(), asked.rows()
        asked.drawn(distributions)

    return one


def _api(folder: Path) -> Callable[[random.Random], object]:
    """Calls of the Python face with one to three arguments of other types."""
    import gyrobench as gb
    from gyrobench.files import DamagedFmuError  # noqa: F401  what runs need is imported before the first is timed

    data = folder / "m.csv"
    data.write_bytes(CORPUS["fixed_position"])
    test = gb.load("fixed_position", dwell="20s")
    run = gb.reduce("fixed_position", data, out=folder / "run")
    suite = gb.load_suite("drift_test_suite")
    calls: list[tuple[Callable[..., object], dict[str, Any]]] = [
        (gb.load, {"name": "fixed_position", "values": {}, "parts": {}, "maps": {}, "latitude": 0.8}),
        (gb.load_suite, {"name": "drift_test_suite", "values": {}, "parts": {}, "maps": {}}),
        (gb.reduce, {"name": "fixed_position", "data": data, "spec": None, "out": None, "force": False, "k": "1mA"}),
        (lambda **a: gb.compare(a["a"], a["b"], names=a["names"]), {"a": run, "b": folder / "run", "names": ()}),
        (gb.design, {"name": "fixed_position", "wants": {"x": "1deg/h"}, "time": "1h", "criterion": "A", "count": 0}),
        (gb.sweep, {"system": "no", "over": {}, "seeds": 1, "out": None, "workers": 1, "set": {}, "data": None}),
        (gb.campaign, {"definition": {}, "out": None, "scheduler": None, "workers": 1, "retry": False}),
        (gb.site, {"campaign": folder, "out": None, "publish": None}),
        (gb.open_run, {"folder": folder / "run"}),
        (test.set, {"name": "dwell", "value": "20s"}),
        (test.run, {"engine": "none", "seed": 1, "step": "1ms", "timeout": 10.0, "spec": None, "out": None}),
        (test.reduce, {"data": data, "spec": None, "out": None, "force": False, "instrument": "one"}),
        (test.reduce_result, {"result": data, "spec": None, "out": None, "force": False}),
        (run.report, {"folder": None, "force": False}),
        (run.record.frame, {"table": "windows"}),
        (run.record.to_csv, {"folder": folder / "csv"}),
        (suite.set, {"name": "latitude", "value": "45deg"}),
        (suite.reduce, {"runs": [run], "out": folder / "suite", "spec": None, "force": False}),
        (gb.Record.load, {"folder": folder / "run"}),
    ]  # fmt: skip

    def one(rng: random.Random) -> None:
        call, arguments = rng.choice(calls)
        arguments = dict(arguments)
        for _ in range(rng.randint(1, 3)):
            arguments[rng.choice([*arguments, *arguments, "no_such"])] = rng.choice(ODD)
        with contextlib.chdir(folder):  # where names that are taken go
            call(**arguments)

    return one


def _user(folder: Path) -> Callable[[random.Random], object]:
    """Parts and systems that a user writes: what has no line in the file is an error that names it."""
    from gyrobench.packaging.loading import load_part
    from gyrobench.packaging.native_target import c_source
    from gyrobench.system.system import load_system
    from gyrobench.workflow.user_errors import exit_code

    part = b'''from gyrobench.component import Component, Input, Output, Parameter, State
class P(Component):
    """A part."""
    version = "1.0"
    k = Parameter(2.0, "1", "gain", min=0.0)
    u = Input(0.0, "V", "in")
    x = State(0.0, "V", "state")
    y = Output("V", "out")
    def flow(self):
        self.der.x = self.k * (self.u - self.x)
    def outputs(self):
        self.y = self.x if self.x > 0.0 else -self.x
'''
    system = b'''from gyrobench.system.configurable import Option
from gyrobench.system.system import Slot, System
class S(System):
    """A system."""
    title = "t"
    slots = {"site": Slot("Site", "site")}
    options = {"a": Option(1.0, "s", "time", min=0.0)}
    channels = ("site.g",)
    wires = ""
'''
    for name in ("components", "systems", "reports"):
        (folder / name).mkdir()

    def one(rng: random.Random) -> None:
        room, file, text = rng.choice([("components", "model.py", part), ("systems", "system.py", system)])
        home = folder / room / f"own{rng.randrange(1 << 60)}"
        home.mkdir()
        (home / file).write_bytes(changed(text, rng))
        here = os.getcwd()
        os.chdir(folder)
        try:
            c_source(load_part(home.name), "") if room == "components" else load_system(home.name)
        except GyrobenchError:
            raise
        except Exception as error:
            if exit_code(error) is None:  # no line of the file says what is wrong
                raise
        finally:
            os.chdir(here)
            shutil.rmtree(home)
            for name in [n for n in sys.modules if n.startswith(("gyrobench_part_", "gyrobench_system_own"))]:
                del sys.modules[name]

    return one


def _environment(folder: Path) -> Callable[[random.Random], object]:
    """Commands in surroundings that are taken together at random, a process each."""
    if os.name == "nt":
        return lambda rng: None
    (folder / "m.csv").write_bytes(CORPUS["fixed_position"])
    variables = {
        "PYTHONIOENCODING": ["ascii", "cp1252", "utf-16", "latin-1"], "LC_ALL": ["C", "xx"], "PYTHONUTF8": ["0"],
        "GYROBENCH_CACHE": ["/dev/null/x", "\udcff", "/proc/x"], "HOME": ["/dev/null", "", "/nothing"],
        "TMPDIR": ["/dev/null", "/nothing"], "COLUMNS": ["1", "x", "99999"], "TERM": ["dumb", ""], "PATH": ["/nothing"],
        "XDG_CACHE_HOME": ["/dev/null"], "CC": ["/nothing", "false"], "NO_COLOR": ["1"], "PYTHONWARNINGS": ["error"],
    }  # fmt: skip
    shells = [
        '"$@" 2>&-',
        '"$@" <&-',
        '"$@" >&-',
        '"$@" >/dev/full',
        'ulimit -f 1; "$@"',
        'ulimit -n 20; "$@"',
        '"$@" | head -1',
    ]
    commands = [
        "list",
        "show fixed_position",
        "reduce fixed_position --data m.csv --no-report --out {}",
        "build meter",
        "list --json",
    ]

    def one(rng: random.Random) -> None:
        given = {name: rng.choice(values) for name, values in variables.items() if rng.random() < 0.25}
        shell = rng.choice(shells) if rng.random() < 0.6 else '"$@"'
        words = rng.choice(commands).format(f"out{rng.randrange(1 << 60)}").split()
        done = subprocess.run(
            ["/bin/sh", "-c", f"ulimit -v 8000000; {shell}", "sh", sys.executable, "-m", "gyrobench", *words],
            cwd=folder, env={**os.environ, **given}, capture_output=True, timeout=120,
        )  # fmt: skip
        said = (done.stdout + done.stderr).decode("utf-8", "replace").replace("\0", "")
        faults = "Traceback (most recent call last)" in said or done.returncode not in (0, 1, 2, 3, 120, 127)
        assert not faults, f"{given} {shell} {words}: {done.returncode} {said[-600:]}"

    return one


def _stored(folder: Path) -> Callable[[random.Random], object]:
    """One bit of a stored file of each kind: what is read is what was written, or an error or a note says it."""
    homes = stored_files(folder)
    pristine = {home: (read(), {f: f.read_bytes() for f in fs}) for home, (read, fs) in homes.items()}

    def one(rng: random.Random) -> None:
        home = rng.choice(list(homes))
        before, contents = pristine[home]
        file = rng.choice(list(contents))
        at, bit = rng.randrange(len(contents[file])), 1 << rng.randrange(8)
        file.write_bytes(contents[file][:at] + bytes([contents[file][at] ^ bit]) + contents[file][at + 1 :])
        try:
            after = homes[home][0]()
        finally:
            for f, content in contents.items():
                f.write_bytes(content)
        assert after == before or "no SHA-256 of its own" in after, f"{file.name}, byte {at}, bit {bit}: silent"

    return one


def stored_files(folder: Path) -> dict[str, tuple[Callable[[], str], list[Path]]]:
    """Write one of everything that is stored; return for each kind how it is read, as text, and its files."""
    from gyrobench import files
    from gyrobench.campaign.execution.store import Campaign, CampaignStore
    from gyrobench.engine.checkpoint import FILE, _read
    from gyrobench.engine.checkpoint import store as save_checkpoint
    from gyrobench.record import record as tables
    from gyrobench.record.record import Record
    from gyrobench.record.run_document import SuiteDocument, read_run
    from gyrobench.report.report_files import write
    from gyrobench.system.system import load_system
    from gyrobench.workflow.run_comparison import read_result

    def texts(columns: Mapping[str, Any]) -> str:
        return repr({n: c.tolist() for n, c in columns.items()})

    def loaded(home: Path) -> str:
        record = Record.load(home)
        return texts(record.windows) + texts(record.channels) + json.dumps(record.run.as_dict())

    def campaign() -> str:
        stored = Campaign.open(folder / "store")
        log = stored.log().to_csv()
        return f"{stored.arrow().to_pydict()}{stored.units}{json.dumps(stored.definition)}{log}{stored.notes}"

    def checkpoint() -> str:
        head, arrays = _read(folder / FILE)
        return json.dumps(head) + texts(arrays)

    def cached() -> str:
        return files.make_once(folder / "library.so", lambda path: path.write_bytes(b"library" * 99)).read_text("utf-8")

    system = load_system("fixed_position")
    (folder / "base.csv").write_bytes(CORPUS["fixed_position"])
    record = system.read_measured(folder / "base.csv", {})
    record.channels = {"time": np.arange(50.0), "gyro.u": np.sin(np.arange(50.0))}
    record.save(folder / "run")
    write(system.reduce(record, None), folder / "run", ("json",))
    (folder / "text").mkdir()
    tables._write_csv(list(record.windows), list(record.windows.values()), folder / "text" / "record.csv")
    record.run.tables = {"record.csv": files.sha256(folder / "text" / "record.csv")}
    record.run.write(folder / "text")
    (folder / "suite").mkdir()
    SuiteDocument(system="drift_test_suite", runs=["a", "b"], options={"latitude": 0.8}).write(folder / "suite")
    rows = [
        {"run": f"{k:016x}", "index": k, "system": "toy", "seed": k, "state": "done", "in.T": 300.0 + k,
         "a.estimate": 0.1 * k - 0.396, "a.u": 0.01, "verdict": "pass", "warnings": ["one"]}
        for k in range(20)
    ]  # fmt: skip
    with CampaignStore(folder / "store") as store:
        units = {"in.T": "K", "a.estimate": "°/h", "a.u": "°/h"}
        store.begin({"name": "lot", "axes": [{"name": "T"}]}, {r["run"]: {"index": r["index"]} for r in rows}, units)
        store.append(rows, units, [{"run": r["run"], "worker": "w", "attempts": 1, "seconds": 0.5} for r in rows])
    save_checkpoint(folder / FILE, {"job": {"seed": 3}, "k": 7}, {"out": np.arange(40.0), "last": np.zeros(1)})
    cached()
    runs = [f for f in (folder / "run").iterdir() if f.name != "result.json"]
    return {
        "record": (lambda: loaded(folder / "run"), runs),
        "record as text": (lambda: loaded(folder / "text"), list((folder / "text").iterdir())),
        "result": (lambda: json.dumps(read_result(folder / "run").as_dict()), [folder / "run" / "result.json"]),
        "suite": (lambda: json.dumps(read_run(folder / "suite").as_dict()), [folder / "suite" / "run.json"]),
        "campaign": (campaign, [f for f in (folder / "store").rglob("*") if f.is_file()]),
        "checkpoint": (checkpoint, [folder / FILE]),
        "cache": (cached, [folder / "library.so", folder / "library.so.sha256"]),
    }


def _columns(folder: Path) -> Callable[[random.Random], object]:
    """Files of a laboratory and their column maps: proposed, read and used."""
    from messy_file import messy

    from gyrobench.system.system import load_system
    from gyrobench.workflow.fit_columns import write_columns
    from gyrobench.workflow.measured_run import reduce_measured

    file, columns, good = folder / "messy.csv", folder / "map.toml", messy()[0]
    file.write_bytes(good)
    proposed = write_columns(file, "fixed_position", None)[0].encode()
    values = {"latitude": "45deg", "k": "17deg/h/mA", "attitude": "E U -N"}

    def one(rng: random.Random) -> None:
        file.write_bytes(changed(good, rng) if rng.random() < 0.5 else good)
        columns.write_bytes(changed(proposed, rng))
        write_columns(file, rng.choice(["fixed_position", "tumble_single_axis", "drift_record"]), None)
        reduce_measured(load_system("fixed_position"), file, values, in_memory=True, columns=columns)

    return one


OF_USES = (_columns, _stored, _campaign, _api, _user, _environment)
