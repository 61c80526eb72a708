"""Fixtures shared by all tests."""

from __future__ import annotations

import os

import pytest


@pytest.fixture(scope="session", autouse=True)
def build_cache(tmp_path_factory: pytest.TempPathFactory) -> None:
    """Builds of the tests go to a folder of the session, unless GYROBENCH_CACHE names one."""
    os.environ.setdefault("GYROBENCH_CACHE", str(tmp_path_factory.mktemp("cache")))
