"""What all tests share: one cache of built FMUs for the session and its processes."""

from __future__ import annotations

import gc
import math
import os
import shutil
import signal
import sys
import tempfile
import threading
from collections.abc import Callable, Generator, Iterator
from pathlib import Path
from typing import TYPE_CHECKING

import pytest
from commanding import Command

if TYPE_CHECKING:
    from gyrobench.system.system import System

BLANK = '<svg xmlns="http://www.w3.org/2000/svg" width="1pt" height="1pt" viewBox="0 0 1 1"></svg>'
CREATED = "GYROBENCH_TEST_CACHE"  # the folder that this session has created, if it has
for threads in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS"):  # the test processes share the cores
    os.environ.setdefault(threads, "1")


def pytest_configure(config: pytest.Config) -> None:
    """Builds go to a folder of the session, which its processes share, unless GYROBENCH_CACHE names one."""
    if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:  # in the background of a shell: tests interrupt their runs
        signal.signal(signal.SIGINT, signal.default_int_handler)
    if "GYROBENCH_CACHE" not in os.environ:
        os.environ["GYROBENCH_CACHE"] = os.environ[CREATED] = tempfile.mkdtemp(prefix="gyrobench-tests-")


def pytest_unconfigure(config: pytest.Config) -> None:
    if not hasattr(config, "workerinput") and CREATED in os.environ:
        shutil.rmtree(os.environ.pop(CREATED), ignore_errors=True)


@pytest.hookimpl(wrapper=True)
def pytest_collection() -> Generator[None, object, object]:
    """The modules and the eight thousand tests stay to the end: the search for garbage leaves them out, and is rarer.

    It took a sixth of the time of the tests.
    """
    gc.disable()
    try:
        return (yield)
    finally:
        gc.enable()
        gc.freeze()
        gc.set_threshold(20_000, 20, 20)


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """The files of the commands, of few and long tests, come first: no process waits at the end for another's last."""
    items.sort(key=lambda item: item.path.parent != Path(__file__).parent)


@pytest.fixture
def chinese_font() -> None:
    """Skips a test where no font of the machine has Chinese characters; a package such as fonts-noto-cjk brings one."""
    from gyrobench.report import fonts

    try:
        fonts.fonts_for(["测"])
    except fonts.MissingFontError:
        pytest.skip("no font of this machine has Chinese characters")


@pytest.fixture(scope="session", autouse=True)
def forks() -> Iterator[None]:
    """Runs fork, as those of a command do: the threads of a test process that are there before its tests hold no lock.

    Each run would start Python anew, for a quarter of a second.
    """
    from gyrobench.engine import supervision

    before = set(threading.enumerate())
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(supervision, "can_fork", lambda: sys.platform == "linux" and set(threading.enumerate()) <= before)
        yield


@pytest.fixture
def command(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> Command:
    """Run a gyrobench command: exit code, standard output, standard error.  Anything but an exit fails the test.

    pages: a run or reduction writes its HTML and PDF too, which takes a second, three quarters of it for the figures;
    figures false leaves those blank, for the text of a page whose like another test draws.  The step of a run is not
    checked unless --check-step is among the words, or default_check is true.
    """

    def run(
        *words: object, pages: bool = False, default_check: bool = False, figures: bool = True
    ) -> tuple[int, str, str]:
        from gyrobench.commands import cli

        plain = [] if pages or words[0] not in ("run", "reduce") else ["--no-report"]
        if words[0] == "run" and "--check-step" not in words and not default_check:
            plain.append("--no-check-step")
        monkeypatch.setattr(sys, "argv", ["gyrobench", *map(str, words), *plain])
        capsys.readouterr()
        with monkeypatch.context() as patch:
            if not figures:
                from matplotlib.backends.backend_svg import FigureCanvasSVG

                patch.setattr(FigureCanvasSVG, "print_svg", lambda _, file, **__: file.write(BLANK))
            try:
                cli.main()
                code = 0
            except SystemExit as end:
                code = int(end.code or 0)
        out, err = capsys.readouterr()
        assert "Traceback" not in err or "GYROBENCH_TRACEBACK" in os.environ
        return code, out, err

    return run


@pytest.fixture
def gyrobench(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, command: Command) -> Command:
    """Run a command in an empty folder: exit code, standard output, standard error."""
    monkeypatch.chdir(tmp_path)
    return command


@pytest.fixture(scope="session")
def foreign(tmp_path_factory: pytest.TempPathFactory) -> Callable[..., Path]:
    """Builds an FMU of tests/foreign once, with each set of the compiler's flags."""
    import foreign_fmus

    done: dict[tuple[str, ...], Path] = {}

    def make_once(name: str, *flags: str) -> Path:
        key = (name, *flags)
        if key not in done:
            done[key] = foreign_fmus.make(name, tmp_path_factory.mktemp("foreign"), *flags)
        return done[key]

    return make_once


@pytest.fixture
def small() -> System:
    """The small tumble of tests/support."""
    from small_tumble import SmallTumble

    return SmallTumble()


@pytest.fixture
def fewer_weights(monkeypatch: pytest.MonkeyPatch) -> None:
    """No power laws among the noise models: for tests of what an error of known size does to estimates, whose weights
    are to stay the same in the records with it and without.
    """
    monkeypatch.setattr("gyrobench.reduction.estimation.noise.BROAD", math.inf)
