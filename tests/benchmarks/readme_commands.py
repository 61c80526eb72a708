"""Every command and every block of code that README and guides print, as printed, with gyrobench from its wheel.

    python tests/benchmarks/readme_commands.py                        # all pages, half an hour
    python tests/benchmarks/readme_commands.py systems/north_finder   # pages whose path holds one of the words

Each page is read in an empty folder, each command in a process of its own.  What commands need beside the page, and
which are not run and why, stands in tests/printed/declared.py.  A page that breaks its promise is named with the
command and what it said; the exit code is 1.
"""

from __future__ import annotations

import sys
import tempfile
import time
import traceback
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1] / "support"))

from printed import declared, pages
from printed.reader import Installed, Reader, build_wheel, install


def read(installed: Installed, page: str, folder: Path) -> str | None:
    """Do what a page says; return why it cannot be done, or None."""
    reader = Reader(installed, page, folder)
    fault = None
    for step in reader.steps:
        if step.kind == "command" and declared.is_any(declared.NOT_RUN, step.text):
            continue
        try:
            done = reader.follow(step)
            if done is not None:
                print(f"  {done.processor:5.1f} s  {step.text.splitlines()[0][:150]}", flush=True)
        except Exception:
            fault = f"{fault or ''}{step.place}: {step.text.splitlines()[0]}\n{traceback.format_exc()[-1500:]}\n"
    if reader.done:
        seconds, processor = (sum(getattr(d, n) for d in reader.done) for n in ("seconds", "processor"))
        print(f"{page}: {len(reader.done)} steps, {seconds:.0f} s, {processor:.0f} s of CPU time", flush=True)
    return fault


def main(words: list[str]) -> int:
    start, faults = time.perf_counter(), []
    followed = [p for p in pages.pages() if p not in pages.NOT_FOLLOWED]
    with tempfile.TemporaryDirectory(prefix="gyrobench-printed-") as place:
        installed = install(build_wheel(Path(place)), Path(place))
        for k, page in enumerate(p for p in followed if not words or any(w in p for w in words)):
            if fault := read(installed, page, Path(place) / f"page-{k}"):
                faults.append(fault)
                print(f"FAILED {fault}", flush=True)
    print(f"{time.perf_counter() - start:.0f} s; pages that break their promise: {len(faults)}")
    return bool(faults)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
