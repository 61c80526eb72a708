"""TOML, JSON and XML from outside, within limits: any text gives plain values or one error for a person.

The error is of the type that the caller names, made from one text: FILE: what is wrong.  Limits: LARGEST bytes of a
file, DEEPEST levels; XML without a document type, whose entities could grow without end.  Numbers may be any that a
float holds: what they mean is checked where they are used.
"""

from __future__ import annotations

import json
import re
import tomllib
from collections.abc import Callable
from pathlib import Path
from typing import Any
from xml.etree import ElementTree as ET

LARGEST = 1 << 28  # bytes: the run.json of a long run with its linear models has some 10 MB
DEEPEST = 200  # levels; Python's own readers give up at about a thousand
CONTAINERS = (dict, list, ET.Element)
Raise = Callable[[str], Exception]


def shorten(text: str, most: int = 60) -> str:
    """Return a text for a message, the end of a long one cut off."""
    return text if len(text) <= most else f"{text[:most]}..."


def read_text(file: Path, error: Raise) -> str:
    """Return the text of a file, UTF-8."""
    try:
        if file.stat().st_size > LARGEST:
            raise error(f"{file}: larger than {LARGEST >> 20} MB; such a file cannot hold what is asked for")
        return file.read_bytes().decode("utf-8-sig")
    except OSError as cause:
        raise error(f"{file}: {cause.strerror or cause}") from None
    except UnicodeDecodeError as cause:
        raise error(f"{file}: not UTF-8 text (byte {cause.start})") from None


def toml(text: str, name: object, error: Raise) -> dict[str, Any]:
    """Return the content of a TOML text; name: of its file, for the error."""
    data: dict[str, Any] = _within(tomllib.loads, text, name, "TOML", error)
    return data


def json_value(text: str, name: object, error: Raise) -> Any:
    """Return the value of a JSON text."""
    return _within(json.loads, text, name, "JSON", error)


def json_object(text: str, name: object, error: Raise) -> dict[str, Any]:
    """Return the object in a JSON text."""
    data = json_value(text, name, error)
    if not isinstance(data, dict):
        raise error(f"{name}: not a JSON object {{...}}")
    return data


def xml(data: bytes, name: object, error: Raise) -> ET.Element:
    """Return the root of an XML document."""
    if b"\0" in data:  # text of two bytes a letter, in which a document type would not be seen
        raise error(f"{name}: not UTF-8 text (a byte of 0)")
    if re.search(rb"<!\s*(DOCTYPE|ENTITY)", data, re.I):
        raise error(f"{name}: XML with a document type (<!DOCTYPE>), which is not read; remove it")
    root: ET.Element = _within(ET.fromstring, data, name, "XML", error)
    return root


def _within(read: Callable[[Any], Any], text: Any, name: object, kind: str, error: Raise) -> Any:
    """Return what a reader makes of a text, of no more levels than those that go through it later can take."""
    try:
        value = read(text)
    except RecursionError:
        value = None
    except (ValueError, LookupError, ET.ParseError) as cause:  # of tomllib, of json; of XML in an unknown encoding
        raise error(f"{name}: not {'an' if kind == 'XML' else 'a'} {kind} file: {shorten(str(cause), 200)}") from None
    else:
        level = [value]
        for _ in range(DEEPEST):
            inside = (v.values() if isinstance(v, dict) else v for v in level if isinstance(v, CONTAINERS))
            level = [v for values in inside for v in values if isinstance(v, CONTAINERS)]
            if not level:
                return value
    raise error(f"{name}: {kind} of more than {DEEPEST} levels")
