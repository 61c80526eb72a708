"""From a controller to the settings of a run: parameters of the part in the slot, or of a part that takes any."""

from __future__ import annotations

import contextlib
import logging
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np

from gyrobench.bench import Bench
from gyrobench.engine.session import Session
from gyrobench.errors import GyrobenchError
from gyrobench.system.system import System
from gyrobench.tuning.own_controllers import own_controller, own_values
from gyrobench.tuning.structures import Controller, ControllerStructure

ANY = ("form", "num", "den", "conditioned")  # parameters of a part that takes any transfer function
NETWORK = ("K", "tau1", "T1", "tau2", "T2", "integral")


class TuningError(GyrobenchError, ValueError):
    """A loop that cannot be tuned; the text says why."""


@contextlib.contextmanager
def quiet() -> Iterator[None]:
    """Keep back what the runs of a proof would warn of: that parts are off their nominal values is meant."""
    log = logging.getLogger("gyrobench")
    level = log.level
    log.setLevel(logging.ERROR)
    try:
        yield
    finally:
        log.setLevel(level)


def settings_of(
    shape: ControllerStructure, controller: Controller, nominal: Mapping[str, Any], system: System, slot: str
) -> tuple[str, dict[str, Any]]:  # fmt: skip
    """Return the part to put into the slot ("": its own) and the settings that make it this controller."""
    owners = {option.sets: name for name, option in system.options.items()}  # "stabilizer.K" -> its option
    own_kind = own_controller(nominal, slot)
    if own_kind is not None:
        found = own_kind.settings(controller, own_values(nominal, slot))
        return "", {owners.get(f"{slot}.{n}", f"{slot}.{n}"): nine_digits(v) for n, v in found.items()}
    if shape.is_lead_lag and all(f"{slot}.{n}" in nominal for n in NETWORK):
        neutral = {"tau1": 1.0, "T1": 1.0, "tau2": 0.01, "T2": 0.01, "integral": 0.0}
        values = {**neutral, **{n: float(v) for n, v in controller.values.items()}}
        names = (f"{slot}.{n}" for n in NETWORK)
        return "", {owners.get(n, n): nine_digits(values[n.partition(".")[2]]) for n in names}
    own = all(f"{slot}.{n}" in {k.partition("[")[0] for k in nominal} for n in ANY)
    num, den = (list(np.trim_zeros(p, "b")) for p in (controller.num, controller.den))
    for n, row in (("num", num), ("den", den)):  # what the design of the system has beyond is taken away
        row += [0.0] * (len(np.trim_zeros(np.atleast_1d(nominal.get(f"{slot}.{n}", 0.0)), "b")) - len(row))
    direct = len(np.trim_zeros(num, "b")) == len(np.trim_zeros(den, "b"))
    return "" if own else part_of_any(), {
        f"{slot}.form": 1,
        f"{slot}.num": num,
        f"{slot}.den": den,
        **({f"{slot}.conditioned": 1} if direct and minimum_phase(controller) else {}),
    }


def nine_digits(value: Any) -> Any:
    """Return a number, or each of a list, to nine digits, as it is printed."""
    return [nine_digits(v) for v in value] if isinstance(value, list) else float(f"{value:.9g}")


def minimum_phase(controller: Controller) -> bool:
    """Return whether the zeros of a controller are stable: else its states cannot follow a limited voltage."""
    return bool(np.all(np.roots(np.trim_zeros(np.array(controller.num), "b")[::-1]).real < 0.0))


def part_of_any() -> str:
    """Return the part of the bench that takes any transfer function.  Raises TuningError where there is none."""
    bench = Bench.find()
    for name, folder in bench.parts().items():
        text = (folder / "model.py").read_text(encoding="utf-8")
        if all(f"    {n} = Parameter(" in text for n in ANY):
            return name
    raise TuningError(
        f"the bench has no part that takes a transfer function ({', '.join(ANY)}); use structure lead-lag"
    )


def plan_settings(
    system: System, nominal: Mapping[str, Any], session: Session, settings: Mapping[str, Any],
    crossed: Sequence[tuple[float, float]], slot: str,
) -> dict[str, Any]:  # fmt: skip
    """Return the option crossover, whose sines the system's own plan has, where nothing else follows it."""
    option = system.options.get("crossover")
    if option is None or not crossed:
        return {}
    at = float(f"{max(c[0] for c in crossed):.4g}")
    if not (option.min or 0.0) <= at <= (option.max or np.inf):
        return {}
    try:
        with quiet():
            other = session.prepare({"crossover": at})[2].parameters
    except GyrobenchError:
        return {}
    plain = {n: v for n, v in nominal.items() if n.partition(".")[0] not in (slot, "exciter")}
    return {"crossover": f"{at:g}Hz"} if all(other.get(n) == v for n, v in plain.items()) else {}
