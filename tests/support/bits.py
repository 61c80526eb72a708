"""The numbers of a system's first steps as one digest, from whatever has made them.

The digest is the SHA-256 of the channels by name, each its name and its values after the steps 1 to STEPS as doubles,
the lowest byte first.
"""

from __future__ import annotations

import hashlib
import json
import subprocess
import tomllib
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from gyrobench.bench import Bench, standard_folder
from gyrobench.engine.session import Session
from gyrobench.exchange import html_page
from gyrobench.exchange.system_fmu import linked_source
from gyrobench.exchange.system_source import source_files
from gyrobench.packaging.compiler import compile_wasm
from gyrobench.system.suite import Suite, load_test
from gyrobench.system.system import System, load_system

STEPS, SEED = 200, 7
TABLE = Path(__file__).parents[1] / "engine" / "record_digests.toml"
PAGE = Path(__file__).with_name("page_in_node.mjs")


def systems() -> list[str]:
    return sorted(n for n in Bench(standard_folder()).systems() if not isinstance(load_test(n), Suite))


def expected() -> dict[str, str]:
    return tomllib.loads(TABLE.read_text(encoding="utf-8"))["digests"]


def digest(channels: Mapping[str, Any]) -> str:
    sha = hashlib.sha256()
    for name in sorted(channels):
        values = np.asarray(channels[name], dtype="<f8")
        assert values.shape == (STEPS,), name
        sha.update(name.encode() + b"\0" + values.tobytes())
    return sha.hexdigest()


def first_steps(name: str, patch: pytest.MonkeyPatch) -> System:
    """Return a system that ends after its first steps and records each of them."""
    system = load_system(name, standard_folder())
    for attribute, value in {"stop": STEPS * system.step, "channel_period": system.step, "loops": ()}.items():
        patch.setattr(type(system), attribute, value)
    return system


def recorded(system: System, engine: str = "native", target: str = "native") -> dict[str, Any]:
    """Return the channels of a run of this bench."""
    with Session(system, engine=engine, target=target, bench=standard_folder()) as session:
        channels = session.run(seed=SEED).channels
    return {n: x[1:] for n, x in channels.items() if n != "time"}


def in_node(system: System, node: str, channels: list[str], folder: Path) -> dict[str, Any]:
    """Return the same from the WebAssembly of the system's page."""
    source = linked_source(system, None, None, None, SEED, None, (), "html", "no page can be made of it").source
    files = {**source_files(source, "", 2), "page.c": (html_page.HERE / "page.c").read_text(encoding="utf-8")}
    for file, text in files.items():
        (folder / file).write_text(text, encoding="utf-8")
    (folder / "page.wasm").write_bytes(compile_wasm(folder / "page.c"))
    outputs = [e.scalar.name for e in source.section("output")]
    words = [node, str(PAGE), str(folder / "page.wasm"), str(len(outputs)), str(STEPS), str(folder / "rows")]
    done = subprocess.run(words, capture_output=True, text=True, timeout=120, check=False)
    assert done.returncode == 0, done.stderr
    rows = np.fromfile(folder / "rows").reshape(STEPS + 1, len(outputs) + 1)
    return {n: rows[1:, 1 + outputs.index(n)] for n in channels}


def table(digests: Mapping[str, str]) -> str:
    """Return the text of the file of digests."""
    head = [
        "# SHA-256 of the records of the first 200 steps of every system, seed 7: see tests/support/bits.py.",
        "# Any platform and target gives the same; Python's own sin may change the last digit of a parameter.",
        "# Write it again, where a part has changed, with",
        "# `python tests/benchmarks/same_bits.py --write`.",
        "[digests]",
    ]
    return "\n".join([*head, *(f"{n} = {json.dumps(d)}" for n, d in digests.items()), ""])
