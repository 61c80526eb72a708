"""The tumble system, prepared once, and a reduction without its slowest part."""

from __future__ import annotations

from collections.abc import Iterator

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
