"""TOML, JSON and XML from outside: limits, and errors of the type that was asked for."""

from __future__ import annotations

from pathlib import Path

import pytest

from gyrobench import reading
from gyrobench.bench import UsageError


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("[" * 5000, "JSON of more than 200 levels"),
        ("{1: 2}", "not a JSON file"),
        ("[1]", "not a JSON object"),
        ('{"a": ' + "9" * 5000 + "}", "not a JSON file: Exceeds the limit"),
    ],
)
def test_json(text: str, said: str) -> None:
    with pytest.raises(UsageError, match=f"x.json: {said}"):
        reading.json_object(text, "x.json", UsageError)


def test_toml() -> None:
    assert reading.toml("a = [1, 2.5]", "x", UsageError) == {"a": [1, 2.5]}
    with pytest.raises(UsageError, match=r"x.toml: TOML of more than 200 levels"):
        reading.toml("a = " + "[" * 5000, "x.toml", UsageError)
    with pytest.raises(UsageError, match=r"x.toml: not a TOML file: Invalid value"):
        reading.toml("a = ", "x.toml", UsageError)


def test_xml() -> None:
    """A document type could name an entity of entities of entities: a billion from a kilobyte."""
    assert reading.xml(b"<a><b/></a>", "x", UsageError)[0].tag == "b"
    with pytest.raises(UsageError, match="x: XML with a document type"):
        reading.xml(b'<!DOCTYPE a [<!ENTITY b "c">]><a>&b;</a>', "x", UsageError)
    with pytest.raises(UsageError, match="x: not UTF-8 text"):
        reading.xml('<!DOCTYPE a [<!ENTITY b "c">]><a>&b;</a>'.encode("utf-16"), "x", UsageError)
    with pytest.raises(UsageError, match="x: XML of more than 200 levels"):
        reading.xml(b"<a>" * 300 + b"</a>" * 300, "x", UsageError)
    with pytest.raises(UsageError, match="x: not an XML file: mismatched tag"):
        reading.xml(b"<a></b>", "x", UsageError)
    with pytest.raises(UsageError, match="x: not an XML file: unknown encoding: ut1e15f-8"):
        reading.xml(b'<?xml version="1.0" encoding="ut1e15f-8"?><a/>', "x", UsageError)


def test_text(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    file = tmp_path / "t.toml"
    file.write_bytes(b"\xef\xbb\xbfa = 1")
    assert reading.read_text(file, UsageError) == "a = 1", "without the mark of an editor"
    file.write_bytes(b"a = \xff")
    with pytest.raises(UsageError, match=r"t.toml: not UTF-8 text \(byte 4\)"):
        reading.read_text(file, UsageError)
    with pytest.raises(UsageError, match="No such file"):
        reading.read_text(tmp_path / "none", UsageError)
    monkeypatch.setattr(reading, "LARGEST", 3)
    with pytest.raises(UsageError, match="larger than 0 MB"):
        reading.read_text(file, UsageError)
