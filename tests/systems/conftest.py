"""The tumble system, prepared once, the foreign FMUs, and the commands called as a user calls them."""

from __future__ import annotations

import importlib.util
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from tumbling import NAME

from gyrobench.engine.session import Session


@pytest.fixture(scope="session")
def session() -> Iterator[Session]:
    """The standard parts under the native engine; every run starts afresh."""
    with Session(NAME) as prepared:
        yield prepared


@pytest.fixture
def no_arma(monkeypatch: pytest.MonkeyPatch) -> None:
    """A drift record is described without ARMA and ARIMA models, which take two thirds of its reduction."""
    from gyrobench.reduction.series import drift_model
    from gyrobench.reduction.series.checks import SeriesError

    def refused(*_: object) -> None:
        raise SeriesError("not looked at here")

    for name in ("fit_arma", "arima310"):
        monkeypatch.setattr(drift_model, name, refused)


@pytest.fixture(scope="session")
def foreign(tmp_path_factory: pytest.TempPathFactory) -> Callable[[str], Path]:
    """Builds a foreign FMU of tests/foreign once."""
    file = Path(__file__).parents[1] / "foreign" / "make.py"
    spec = importlib.util.spec_from_file_location("foreign_make", file)
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    folder = tmp_path_factory.mktemp("foreign")
    done: dict[str, Path] = {}

    def make_once(name: str) -> Path:
        if name not in done:
            done[name] = module.make(name, folder)
        return done[name]

    return make_once
