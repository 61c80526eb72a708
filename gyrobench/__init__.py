"""FMI co-simulation bench for inertial instruments and stabilized platforms.

    import gyrobench as gb

    run = gb.load("tumble_single_axis", latitude="45.75deg").run(seed=3)
    run.result["D_I"].estimate

The calls are those of :mod:`gyrobench.library`, which is imported when the first of them is used.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    __version__: str
    from gyrobench.library import (
        Comparison,
        Experiment,
        GyrobenchError,
        Record,
        Result,
        Run,
        SuiteExperiment,
        SuiteRun,
        campaign,
        compare,
        design,
        identify,
        load,
        load_suite,
        multisine,
        open_run,
        reduce,
        site,
        sweep,
        tune,
    )

__all__ = [
    "Comparison", "Experiment", "GyrobenchError", "Record", "Result", "Run", "SuiteExperiment", "SuiteRun", "campaign",
    "compare", "design", "identify", "load", "load_suite", "multisine", "open_run", "reduce", "site", "sweep", "tune",
]  # fmt: skip


if not TYPE_CHECKING:  # a type checker would take any name for one of the module

    def __getattr__(name: str) -> Any:
        """Import what is used of the library."""
        if name == "__version__":
            from importlib.metadata import version

            return version("gyrobench")
        if name not in __all__:
            raise AttributeError(f"module 'gyrobench' has no attribute '{name}'; it offers {', '.join(__all__)}")
        import importlib

        return getattr(importlib.import_module("gyrobench.library"), name)


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__, "__version__"})
