"""Values of command line arguments: settings, parts and mapping files of slots, times."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from gyrobench import reading
from gyrobench.bench import UsageError
from gyrobench.files import missing
from gyrobench.system.values import InvalidValueError, parse_number


def parse_assignments(values: list[str] | None, option: str, example: str) -> dict[str, str]:
    """Return ``["a.b=1"]`` as ``{"a.b": "1"}``.

    Raises UsageError for an entry without ``=`` and for a name given twice.
    """
    assignments: dict[str, str] = {}
    for v in values or []:
        name, sign, value = (x.strip() for x in v.partition("="))
        if not (sign and name and value):
            raise UsageError(f"{option} {v}: write NAME=VALUE, for example {option} {example}")
        if name in assignments:
            raise UsageError(f"{option} {name}: given twice, {assignments[name]} and {value}")
        assignments[name] = value
    return assignments


def require_suffix(option: str, file: Path | None, suffix: str, kind: str) -> None:
    """Raise UsageError for a file to write whose name has another ending: it may hold something else."""
    if file is not None and file.suffix != suffix:
        raise UsageError(f"{option} {file}: {kind} ends in {suffix}")


def parse_settings(values: list[str] | None) -> dict[str, str]:
    """Return the values of --set by name; those given one by one go before those of files.  Raises UsageError."""
    from_files: dict[str, str] = {}
    for v in values or []:
        if v.startswith("@"):
            from_files |= read_settings(Path(v[1:].strip()))
    singly = [v for v in values or [] if not v.startswith("@")]
    return from_files | parse_assignments(singly, "--set", "latitude=45.75deg")


def read_settings(file: Path) -> dict[str, str]:
    """Return the values of a TOML file by name: options at the top, parameters of a part in a table named as its slot.

    Raises UsageError.
    """

    def unreadable(why: str) -> UsageError:
        return UsageError(f"--set @{why}")

    content = reading.toml(reading.read_text(file, unreadable), file, unreadable)
    settings: dict[str, str] = {}

    def add(name: str, value: Any) -> None:
        if isinstance(value, dict):
            for inner, v in value.items():
                add(f"{name}.{inner}" if name else inner, v)
        elif isinstance(value, str):
            settings[name] = value
        elif isinstance(value, bool | int | float | list):
            settings[name] = json.dumps(value)
        else:
            raise UsageError(f"--set @{file}: {name} = {value}: write a number (SI), a text with its unit, or a list")

    add("", content)
    return settings


def parse_swaps(part: list[str] | None, mapping: list[str] | None) -> tuple[dict[str, str], dict[str, Path]]:
    """Return parts and mapping files by slot.  Raises UsageError for a file that does not exist.

    A controller's file that stands here was named by the user, and so may be compiled.
    """
    from gyrobench.packaging.own_controller import allow

    parts = parse_assignments(part, "--part", "gyro=vendor.fmu")
    for named in parts.values():
        allow(named)
    maps = {k: Path(v) for k, v in parse_assignments(mapping, "--map", "gyro=vendor.toml").items()}
    for slot, file in maps.items():
        if not file.is_file():
            raise UsageError(f"--map {slot}={file}: {missing(file)}")
    return parts, maps


def parse_time(option: str, text: str | None) -> float | None:
    """Return the time given by an option in s.  Raises InvalidValueError, for one that is not > 0 too."""
    if text is None:
        return None
    time = parse_number(option, text, "s")
    if not time > 0.0:
        raise InvalidValueError(f"{option} = {text}: must be > 0")
    return time
