"""The records of all systems against the table of digests: here and, where node is installed, in WebAssembly.

Run by hand: ``python tests/benchmarks/same_bits.py [--write] [system ...]``; some minutes.  --write: the table
anew, from the native target alone, for some seconds.
"""

from __future__ import annotations

import shutil
import sys
import tempfile
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).parents[1] / "support"))

from bits import TABLE, digest, expected, first_steps, in_node, recorded, systems, table

from gyrobench.exchange.ssp_export import ExportError


def main() -> int:
    write = "--write" in sys.argv
    names = [n for n in sys.argv[1:] if n != "--write"] or systems()
    node, found, wrong = None if write else shutil.which("node"), {}, 0
    for name in names:
        with pytest.MonkeyPatch.context() as patch, tempfile.TemporaryDirectory() as folder:
            system = first_steps(name, patch)
            channels = recorded(system)
            found[name] = digest(channels)
            places = {"native": found[name]}
            if node:
                try:
                    places["node"] = digest(in_node(system, node, list(channels), Path(folder)))
                except ExportError as e:
                    print(f"{name}: not in node: {e}")
        truth = found[name] if write else expected().get(name)
        off = [place for place, value in places.items() if value != truth]
        wrong += bool(off)
        print(f"{name}: {'differs: ' + ', '.join(off) if off else 'the same in ' + ' and '.join(places)}", flush=True)
    if write:
        known = {**(expected() if TABLE.exists() else {}), **found}
        TABLE.write_text(table({name: known[name] for name in systems() if name in known}))
    return wrong


if __name__ == "__main__":
    sys.exit(main())
