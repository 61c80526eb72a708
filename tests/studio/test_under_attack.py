"""Hostile requests against a studio that listens, and every system's page by its address."""

from __future__ import annotations

import random
import re
from pathlib import Path

import pytest
from studio_requests import Door, wrong

from gyrobench.bench import Bench, standard_folder
from gyrobench.system.suite import Suite
from gyrobench.workflow.inputs import load_test

REQUESTS = 150  # here; 2,000 in tests/benchmarks/studio_load.py


@pytest.fixture(scope="module")
def door(studio: tuple[str, Path]) -> Door:
    return Door.of(studio[0])


def test_nothing_gets_out_and_it_goes_on(door: Door) -> None:
    rng = random.Random(11)
    answered = 0
    for _ in range(REQUESTS):
        raw, whole = door.hostile(rng)
        answer = door.send(raw, whole)
        assert wrong(answer) == "", raw
        answered += bool(answer)
    assert answered > 0.9 * REQUESTS
    assert door.get("/runs")[0] == 200


def test_what_would_give_it_away_is_seen() -> None:
    page = b"HTTP/1.1 200 OK\r\ncontent-type: text/html\r\n\r\n"
    assert wrong(page + b"root:x:0:0:root:/root:/bin/bash") and wrong(b"HTTP/1.1 500 Internal Server Error\r\n\r\n")
    assert wrong(page + b"<script>alert(1)</script>") and wrong(page + b"Traceback (most recent call last):")
    assert not wrong(page + b"&lt;script&gt;alert(1)&lt;/script&gt;") and not wrong(b"")


@pytest.mark.parametrize("name", Bench(standard_folder()).systems())
def test_every_system_has_its_page_with_all_that_can_be_set(door: Door, name: str) -> None:
    """Options and slots by name, the parts that fit as choices; no page says a problem."""
    status, _, answer = door.get(f"/system/{name}")
    text = answer.decode("utf-8", "replace").replace("\\u0022", '"')
    assert status == 200 and 'role="alert"' not in text and '"role":"alert"' not in text
    test = load_test(name)
    missing = [option for option in test.options if not re.search(rf'"{re.escape(option)}"', text)]
    assert missing == []
    if not isinstance(test, Suite):
        assert [slot for slot in test.all_slots() if f"part in {slot}" not in text] == []
        parts = {declared.part for declared in test.all_slots().values()}
        assert [part for part in parts if part not in text] == []
