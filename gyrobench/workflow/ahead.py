"""Modules that a report needs, imported while the run goes on in a process of its own: a second less to wait for."""

from __future__ import annotations

import contextlib
from importlib import import_module
from typing import TYPE_CHECKING

from gyrobench.workflow.feedback import Progress

if TYPE_CHECKING:
    from gyrobench.engine.run_driver import ProgressReport

#: in the order in which they are needed; each takes less than the time between two reports of progress, or little more
MODULES = (
    "scipy.stats", "allantools", "matplotlib.figure", "matplotlib.backends.backend_svg", "gyrobench.report.result_page",
    "gyrobench.report.render", "jinja2", "typst",
)  # fmt: skip


def importing(progress: Progress | None) -> Progress:
    """Return a progress that imports the next of the modules after each report; one that is missing is left out."""
    left = list(MODULES)

    def reported(report: ProgressReport) -> None:
        if progress is not None:
            progress(report)
        if left:
            with contextlib.suppress(ImportError):
                import_module(left.pop(0))

    return reported
