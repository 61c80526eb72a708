"""Charts of the studio: what they take long for keeps nothing else waiting."""

from __future__ import annotations

import asyncio
import threading

import pytest

chart = pytest.importorskip("gyrobench.studio.chart", reason="the studio's packages are not installed")


def test_pages_do_not_wait_for_long_charts() -> None:
    """More charts than the loop has threads, all at work: what a page asks of a thread still comes."""
    free = threading.Event()

    async def busy() -> int:
        charts = [asyncio.create_task(chart.drawn(free.wait)) for _ in range(100)]
        await asyncio.sleep(0.0)
        page = await asyncio.wait_for(asyncio.to_thread(lambda: 7), 30.0)
        assert not any(c.done() for c in charts)
        free.set()
        assert all(await asyncio.gather(*charts))
        return page

    try:
        assert asyncio.run(busy()) == 7
    finally:
        free.set()  # or the threads outlive the test
