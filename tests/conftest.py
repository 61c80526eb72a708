"""What all tests share: one cache of built FMUs for the session and its processes."""

from __future__ import annotations

import os
import shutil
import tempfile

import pytest

CREATED = "GYROBENCH_TEST_CACHE"  # the folder that this session has created, if it has
for threads in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS"):  # the test processes share the cores
    os.environ.setdefault(threads, "1")


def pytest_configure(config: pytest.Config) -> None:
    """Builds go to a folder of the session, which its processes share, unless GYROBENCH_CACHE names one."""
    if "GYROBENCH_CACHE" not in os.environ:
        os.environ["GYROBENCH_CACHE"] = os.environ[CREATED] = tempfile.mkdtemp(prefix="gyrobench-tests-")


def pytest_unconfigure(config: pytest.Config) -> None:
    if not hasattr(config, "workerinput") and CREATED in os.environ:
        shutil.rmtree(os.environ.pop(CREATED), ignore_errors=True)
