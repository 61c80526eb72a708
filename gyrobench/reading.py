"""TOML, JSON and XML from outside, within limits: any text gives plain values or one error for a person.

The error is of the type that the caller names, made from one text: FILE: what is wrong.  Limits: LARGEST bytes of a
file, DEEPEST levels; XML without a document type, whose entities could grow without end.  Numbers may be any that a
float holds: what they mean is checked where they are used.
"""

from __future__ import annotations

import hashlib
import json
import re
import tomllib
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any
from xml.etree import ElementTree as ET

LARGEST = 1 << 28  # bytes: the run.json of a long run with its linear models has some 10 MB
LARGEST_XML = 1 << 26  # bytes: its elements take 20 times as much memory
DEEPEST = 200  # levels; Python's own readers give up at about a thousand
CONTAINERS = (dict, list, ET.Element)
SEAL = "sha256"
SHORTEST = 10  # digits of a digest, those of a report_id
Raise = Callable[[str], Exception]


#: characters that a terminal or a page obeys or cannot show: control characters, directions of writing, bytes of paths
UNSEEN = re.compile("[\ud800-\udfff\x00-\x08\x0b-\x1f\x7f-\x9f\u061c\u200e\u200f\u202a-\u202e\u2066-\u2069]")


def visible(text: str) -> str:
    """Return a text of others for people: characters that would be obeyed as their code, ⟨U+202E⟩."""
    return UNSEEN.sub(lambda found: f"⟨U+{ord(found[0]):04X}⟩", text)


def shorten(text: str, most: int = 60) -> str:
    """Return a text for a message, the end of a long one cut off."""
    return text if len(text) <= most else f"{text[:most]}..."


def require_regular(file: Path, error: Raise) -> Path:
    """Return a file, a folder or what does not exist; raise the error for a pipe or a device, which may never end."""
    if file.exists() and not (file.is_file() or file.is_dir()):
        raise error("a pipe or a device, which cannot be read twice: write it to a file first")
    return file


def read_text(file: Path, error: Raise) -> str:
    """Return the text of a file, UTF-8."""
    require_regular(file, lambda text: error(f"{file}: {text}"))
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


def digest(content: Any) -> str:
    """Return the SHA-256 of JSON values: of their text with sorted keys.  Raises ValueError for NaN and infinities."""
    text = json.dumps(content, sort_keys=True, ensure_ascii=False, allow_nan=False)
    return hashlib.sha256(text.encode("utf-8", "surrogatepass")).hexdigest()


def sealed(content: Mapping[str, Any]) -> dict[str, Any]:
    """Return the content of a document that is stored: with the digest of all its other keys as ``sha256``."""
    return {**content, SEAL: digest(content)}


def opened(data: Mapping[str, Any], name: object, error: Raise) -> tuple[dict[str, Any], bool]:
    """Return the content of a stored document without its digest, and whether it has one: that of 0.1.0 has none."""
    content = {key: value for key, value in data.items() if key != SEAL}
    if SEAL in data:
        check_digest(content, data[SEAL], name, error)
    return content, SEAL in data


def check_digest(content: Mapping[str, Any], expected: object, name: object, error: Raise) -> None:
    """Raise the error where the digest of the content does not begin with what was stored beside it."""
    try:
        found = digest(content)
    except ValueError:  # a number that JSON lacks, which nothing here writes
        found = ""
    if not isinstance(expected, str) or len(expected) < SHORTEST or not found.startswith(expected):
        raise error(f"{name}: changed after it was saved (its SHA-256 is not the one in it)")


def xml(data: bytes, name: object, error: Raise) -> ET.Element:
    """Return the root of an XML document."""
    check_xml(data, name, error)
    root: ET.Element = _within(ET.fromstring, data, name, "XML", error)
    return root


def check_xml(data: bytes, name: object, error: Raise) -> None:
    """Raise the error for an XML document that could grow without end when it is read."""
    if len(data) > LARGEST_XML:
        raise error(f"{name}: XML of {len(data) >> 20} MB; the limit is {LARGEST_XML >> 20} MB")
    if b"\0" in data:  # text of two bytes a letter, in which a document type would not be seen
        raise error(f"{name}: not UTF-8 text (a byte of 0)")
    if re.search(rb"<!\s*(DOCTYPE|ENTITY)", data, re.I):
        raise error(f"{name}: XML with a document type (<!DOCTYPE>), which is not read; remove it")


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
