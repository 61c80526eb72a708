"""Runs that are killed (SIGKILL) at random moments, from their start to the last file of their report, and resumed.

    python tests/benchmarks/kill_at_any_moment.py [200]

Each run is a fork of this process with checkpoints every 20 ms; every eighth one writes HTML and PDF too.  A moment is
uniform over the time that a whole run took last or, three times in four, over a part of it that begins when its
checkpoint, its record or its result is on disk: most of so short a run is its start.  Counted after ``--resume``:
records and results that differ from those of the whole run, files and folders that it does not have, temporary
folders, processes that live on.
"""

from __future__ import annotations

import json
import os
import random
import signal
import sys
import tempfile
import time
from collections import Counter
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1] / "support"))

from processes import processes_in

from gyrobench.commands import cli
from gyrobench.engine import checkpoint, run_driver
from gyrobench.files import TEMPORARY
from gyrobench.record.record import Record

NAME = "tumble_single_axis"
SETTINGS = ["--set", "rate=10deg/s", "--set", "dwell=6", "--set", "windows=12", "--no-check-step"]
MOMENTS = (("", 1.0), (checkpoint.FILE, 0.2), ("run.json", 0.2), ("result.json", 0.1))
ENDED = os.WEXITED | os.WNOHANG | os.WNOWAIT
STAGES = ("report.pdf", "report.html", "result.json", "run.json", checkpoint.FILE)


def start(out: Path, *more: str) -> int:
    """Fork a process that runs the command; return its number."""
    pid = os.fork()
    if pid == 0:
        os.setpgid(0, 0)
        nothing = os.open(os.devnull, os.O_RDWR)
        log = os.open(out.with_name("log"), os.O_WRONLY | os.O_CREAT | os.O_APPEND)
        for target, source in ((0, nothing), (1, log), (2, log)):
            os.dup2(source, target)
        sys.argv = ["gyrobench", "run", NAME, *SETTINGS, "--out", str(out), *more]
        code = 1
        try:
            cli.main()
        except SystemExit as end:
            code = int(end.code or 0)
        finally:
            for folder in Path(tempfile.gettempdir()).glob(f"{TEMPORARY}*"):  # as the end of Python does
                if (folder / ".lock").read_text() == str(os.getpid()):
                    (folder / ".lock").unlink()
                    folder.rmdir()
            os._exit(code)
    return pid


def contents(folder: Path) -> tuple[list[str], list[object]]:
    result = json.loads((folder / "result.json").read_text(encoding="utf-8"))
    return sorted(p.name for p in folder.iterdir()), [result["coefficients"], result["warnings"]]


def main(count: int) -> None:
    checkpoint.FIRST = checkpoint.PERIOD = run_driver.CHUNK = 0.02
    checkpoint.SHARE = 0.0
    moments = random.Random(1)
    with tempfile.TemporaryDirectory(prefix="kill-") as place:
        root = Path(place)
        temporary = root / "tmp"
        temporary.mkdir()
        tempfile.tempdir = str(temporary)
        wholes, seconds = {}, {}
        for plain in (True, False):
            more = ["--no-report"] if plain else []
            for folder in (root / "warm", root / f"whole-{plain}"):
                began = time.monotonic()
                assert os.waitpid(start(folder, *more, "--force"), 0)[1] == 0, (root / "log").read_text()
                seconds[plain] = time.monotonic() - began
            wholes[plain] = folder
        stages: Counter[str] = Counter()
        wrong: Counter[str] = Counter()
        for n in range(count):
            plain = n % 8 != 0
            more = ["--no-report"] if plain else []
            out = root / f"run{n}" / "r"
            out.parent.mkdir()
            pid = start(out, *more)
            stage, wait = moments.choice(MOMENTS)
            while stage and not (out / stage).exists() and os.waitid(os.P_PID, pid, ENDED) is None:
                time.sleep(0.001)
            time.sleep(moments.uniform(0.0, wait * seconds[plain]))
            os.kill(pid, signal.SIGKILL)
            ended = os.waitpid(pid, 0)[1] == 0
            there = [stage for stage in STAGES if (out / stage).is_file()]
            stages["had ended" if ended else there[0] if there else "nothing on disk"] += 1
            end = time.monotonic() + 2.0
            while processes_in(temporary) and time.monotonic() < end:
                time.sleep(0.01)
            wrong["processes"] += len(processes_in(temporary))
            begun = (out / ".lock").is_file()
            if not ended:
                began = time.monotonic()
                code = os.waitpid(start(out, *more, *(["--resume"] if begun else [])), 0)[1]
                if not there:  # a whole run again: the machine may be slower or faster by now
                    seconds[plain] = time.monotonic() - began
                wrong["exit codes"] += code != 0
                if code != 0:
                    print((out.parent / "log").read_text())
                    continue
            same = Record.load(out).same_data(Record.load(wholes[plain]))
            (names, values), (expected, right) = contents(out), contents(wholes[plain])
            wrong["records"] += not same
            wrong["results"] += values != right
            wrong["files"] += names != expected or sorted(p.name for p in out.parent.iterdir()) != ["log", "r"]
            wrong["temporary folders"] += len(list(temporary.iterdir()))
            if (n + 1) % 10 == 0:
                print(f"{n + 1}: {dict(stages)}; wrong: {dict(wrong)}", flush=True)
        print(f"{count} kills; the furthest that was on disk: {dict(stages)}; wrong: {dict(+wrong) or 'nothing'}")


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 200)
