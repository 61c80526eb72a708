"""The system of a module, prepared once, and a reduction without its slowest part."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from pathlib import Path

import pytest
from commanding import Command

from gyrobench.engine.session import Session


@pytest.fixture(scope="module")
def session(request: pytest.FixtureRequest) -> Iterator[Session]:
    """The system NAME of the module: standard parts, native engine, and every run starts afresh."""
    with Session(request.module.NAME) as prepared:
        yield prepared


@pytest.fixture
def refused(command: Command, tmp_path: Path) -> Callable[..., None]:
    """Checks that the command of a run with these values ends before it begins, with each of the words."""

    def check(system: str, values: Sequence[str], words: Sequence[str]) -> None:
        sets = (w for v in values for w in ("--set", v))
        code, out, err = command("run", system, *sets, "--out", tmp_path / "run")
        assert (code, out) == (2, ""), err
        for word in words:
            assert word in " ".join(err.split()), err
        assert not (tmp_path / "run" / "run.json").exists()

    return check


@pytest.fixture
def no_arma(monkeypatch: pytest.MonkeyPatch) -> None:
    """A drift record is described without ARMA and ARIMA models, which take two thirds of its reduction."""
    from gyrobench.reduction.series import drift_model
    from gyrobench.reduction.series.checks import SeriesError

    def refused(*_: object) -> None:
        raise SeriesError("not looked at here")

    for name in ("fit_arma", "arima310"):
        monkeypatch.setattr(drift_model, name, refused)
