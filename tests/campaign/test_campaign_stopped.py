"""Ctrl-C at a terminal, which sends it to every process of the command."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

pytest.importorskip("distributed")


@pytest.mark.skipif(os.name != "posix", reason="process groups of a terminal")
@pytest.mark.long
def test_a_campaign_is_stopped_within_its_runs_and_says_how_it_goes_on(tmp_path: Path) -> None:
    """No worker prints a traceback, and none is waited for: the two runs under way would take hours."""
    words = ["sweep", "fixed_position", "--set", "dwell=20000000s", "--seeds", "2", "--workers", "2", "--out", "c"]
    printed = tmp_path / "printed.txt"
    with printed.open("wb") as out:
        command = subprocess.Popen(
            [sys.executable, "-m", "gyrobench", *words], cwd=tmp_path, stdout=out, stderr=out, start_new_session=True
        )
        end = time.monotonic() + 300.0
        while "0 of 2 runs; 2 workers" not in printed.read_text() and time.monotonic() < end:
            assert command.poll() is None, printed.read_text()
            time.sleep(0.1)
        time.sleep(5.0)  # into the runs
        os.killpg(command.pid, signal.SIGINT)
        assert command.wait(300.0) == 130
    text = printed.read_text()
    assert "Traceback" not in text and "KeyboardInterrupt" not in text
    assert text.strip().endswith(
        "gyrobench: interrupted; 0 of 2 runs are stored in c: the same command runs the others"
    )
