"""Sources of error that a reduction declares (gyrobench.reduction.setup.sources): what a system has by them."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from gyrobench.bench import UsageError
from gyrobench.reduction.setup.sources import declared, known
from gyrobench.system.families.option_groups import type_b

if TYPE_CHECKING:
    from gyrobench.system.system import System


def take_sources(system: type[System], reduction: type) -> None:
    """Give a system the options of the sources of its reduction, and what simulates them among what it assumes."""
    sources = list(declared(reduction).values())
    if sources and not hasattr(reduction, "all_effects"):
        raise TypeError(
            f"{reduction.__name__} declares the source {sources[0].id} by @Source and is no DriftReduction, which "
            "would use it: its error would not be in u"
        )
    system.options = {**system.options, **(type_b(*(s for s in sources if s.option)) | dict(system.options))}
    new = {s.parameter for s in sources} - {"", *system.assumed}
    system.assumed = (*system.assumed, *sorted(new))


def misnamed_sources(system: System) -> list[str]:
    """Return what a system's option corrections names that no test has: a run would end in that refusal."""
    text = str(system.values.get("corrections", ""))
    if not text or not system.reduction:
        return []
    from gyrobench.reduction.estimation.effects import unknown_sources

    return unknown_sources(text, known(system.reduction_object(), type(system).__module__))


def require_options(system: System, reduction: Any, module: str) -> None:
    """Raise UsageError where a reduction, loaded late from its module, states a source that is no option."""
    for name, source in declared(reduction).items():
        if source.option and source.option not in system.options:
            raise UsageError(
                f"{system.name}: {source.option} is no option of it, in which {name}() of {module} states the source "
                f"of error {source.id}. Write options |= type_b(SOURCE) in system.py, or let reduction be the class "
                "itself"
            )
