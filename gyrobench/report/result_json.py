"""``result.json`` as a Python object: the only source of every number on a page.

:func:`document` turns a Result into plain JSON values (NaN and infinities become None) and adds
``derived``: the few numbers a report shows that no reduction delivers (expanded uncertainty, budget
sums, the plan in shown units).  HTML and PDF take numbers from this document by JSON pointer and from
nowhere else.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

from gyrobench import reading
from gyrobench.errors import GyrobenchError
from gyrobench.result import Result

SCHEMA = "gyrobench-result-1"
MODES = {0: "hold", 1: "index", 2: "rate", 3: "servo"}


class ResultError(GyrobenchError, ValueError):
    """A result.json that cannot be read; the text says why."""


def plain(value: Any) -> Any:
    """JSON values only: numpy scalars and arrays to Python, NaN and infinities to None."""
    if value is None or isinstance(value, bool | str):
        return value
    if hasattr(value, "tolist"):  # numpy scalar or array
        value = value.tolist()
    if isinstance(value, bool | int):
        return value
    if isinstance(value, float):
        return value if math.isfinite(value) else None
    if isinstance(value, Mapping):
        return {str(k): plain(v) for k, v in value.items()}
    if isinstance(value, Sequence | set | frozenset) and not isinstance(value, str):
        return [plain(v) for v in (sorted(value) if isinstance(value, set | frozenset) else value)]
    return str(value)


def document(result: Result) -> dict[str, Any]:
    """Return the content of ``result.json``: the result, ``derived``, ``schema`` and ``report_id``."""
    content = plain(result.as_dict())
    content["derived"] = _derived(content)
    return {"schema": SCHEMA, "report_id": content_hash(content), **content}


def report_id(result: Result) -> str:
    """Return ten hexadecimal digits that stand for the content: same numbers and provenance, same id."""
    return str(document(result)["report_id"])


def read_document(text: str, name: object, error: reading.Raise) -> dict[str, Any]:
    """Return the content of a ``result.json``, whose report_id is the digest of all the rest; else raise the error."""
    data = reading.json_object(text, name, error)
    if data.get("schema") != SCHEMA:
        raise error(f"{name}: not a result of gyrobench: 'schema' must be {SCHEMA!r}")
    rest = {key: value for key, value in data.items() if key not in ("schema", "report_id")}
    reading.check_digest(rest, data.get("report_id"), name, lambda text: error(f"{text}; gyrobench report writes it"))
    return data


def load(text: str, name: object = "result.json") -> Result:
    """Return the Result in the text of a ``result.json``; raises ResultError, with the name, for any other text."""
    data = read_document(text, name, ResultError)
    for key in ("schema", "report_id", "derived"):
        data.pop(key, None)
    try:
        return Result.from_dict(data)
    except (KeyError, TypeError) as error:
        raise ResultError(f"{name}: a result with missing or unknown fields: {error}") from None


def pointer(*path: str | int) -> str:
    """RFC 6901 JSON pointer of a path: ``pointer("coefficients", 0, "u")`` is ``/coefficients/0/u``."""
    return "".join("/" + str(p).replace("~", "~0").replace("/", "~1") for p in path)


def value_at(doc: Any, *path: str | int) -> Any:
    """Return the value at a path, None where the path ends early."""
    for key in path:
        try:
            doc = doc[key]
        except (KeyError, IndexError, TypeError):
            return None
    return doc


def content_hash(content: dict[str, Any]) -> str:
    """Return ten hexadecimal digits of the SHA-256 of JSON content."""
    return reading.digest(content)[: reading.SHORTEST]


def _derived(content: dict[str, Any]) -> dict[str, Any]:
    coefficients = content["coefficients"]
    expanded = [_times(c["k"], c["u"]) for c in coefficients]
    difference = [_minus(c["closed"], c["estimate"]) for c in coefficients]
    sums: dict[str, float | None] = {}
    for line in content["budget"]:
        if line["contribution"] is not None:
            sums[line["coefficient"]] = math.hypot(sums.get(line["coefficient"]) or 0.0, line["contribution"])
    plan = value_at(content, "provenance", "plan")
    return {
        "U": expanded,
        "closed_minus_estimate": difference,
        "budget_sum": sums,
        "series": [_moments(s["y"], s["residual"]) for s in content["series"]],
        "plan": [_phase(p) for p in plan] if isinstance(plan, list) else [],
    }


def _moments(y: Sequence[float | None], residual: Sequence[float | None]) -> dict[str, float | None]:
    """Return the mean of the windows and root mean square of the residuals of a series."""
    ys = [v for v in y if v is not None]
    rs = [v for v in residual if v is not None]
    return {
        "mean": math.fsum(ys) / len(ys) if ys else None,
        "residual_rms": math.sqrt(math.fsum(r * r for r in rs) / len(rs)) if rs else None,
    }


def _phase(phase: Mapping[str, Any]) -> dict[str, Any]:
    """Return a phase of the plan in degrees, degrees per hour and seconds, as the plan table shows it."""
    mode = phase.get("mode")
    name = mode if isinstance(mode, str) else MODES.get(int(mode), str(mode)) if mode is not None else ""
    turning = name == "rate"
    degree = 180.0 / math.pi
    return {
        "phase": phase.get("phase"),
        "label": str(phase.get("label", "")),
        "mode": name,
        "shape": phase.get("shape"),
        "face": phase.get("face"),
        "axis": phase.get("axis"),
        "amplitude": phase.get("amplitude"),
        "unit": phase.get("unit"),
        "frequency_Hz": phase.get("frequency"),
        "angle_deg": None if turning else _times(phase.get("target"), degree),
        "angle_y_deg": None if turning else _times(phase.get("target_y"), degree),
        "rate_deg_per_h": _times(phase.get("target"), degree * 3600.0) if turning else None,
        "settle_s": phase.get("settle"),
        "dwell_s": None if turning else phase.get("dwell"),
        "travel_deg": _times(phase.get("travel"), degree) if turning else None,
        "window_s": None if turning else phase.get("window"),
        "window_deg": _times(phase.get("window"), degree) if turning else None,
    }


def _times(a: Any, b: Any) -> float | None:
    return float(a) * float(b) if isinstance(a, int | float) and isinstance(b, int | float) else None


def _minus(a: Any, b: Any) -> float | None:
    return float(a) - float(b) if isinstance(a, int | float) and isinstance(b, int | float) else None
