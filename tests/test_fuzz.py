"""Whatever is read from outside ends in a result or in an error for a person (tests/benchmarks/fuzz.py: 200,000)."""

from __future__ import annotations

from pathlib import Path

import pytest
from fuzzing import attacks

INPUTS = {
    "csv": 1200, "columns": 80, "numbers": 40, "series": 400, "set": 900, "settings": 500, "units": 900, "axes": 900,
    "mapping": 300,
    "spec": 200, "record": 200, "result": 300, "stored": 250, "campaign": 400, "api": 400, "user": 250,
    "environment": 2, "fmu": 75, "ssp": 10, "other": 75,
}  # fmt: skip


@pytest.mark.filterwarnings("ignore")
@pytest.mark.parametrize("kind", INPUTS)
@pytest.mark.long
def test_no_input_ends_in_a_traceback(kind: str, tmp_path: Path) -> None:
    attack = attacks(tmp_path, kind)[kind]
    for seed in range(INPUTS[kind]):
        fault = attack(seed)
        assert fault is None, f"seed {seed}: {fault}"
