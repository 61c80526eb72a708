"""Reads back what a report wrote: JSON, the numbers of the page, the text of the PDF."""

from __future__ import annotations

import json
import shutil
import subprocess
from html.parser import HTMLParser
from pathlib import Path

import pytest


class Numbers(HTMLParser):
    """All <data> elements of a page: (pointer, full value, text)."""

    def __init__(self) -> None:
        super().__init__()
        self.found: list[tuple[str, str, str]] = []
        self._open: dict[str, str] | None = None
        self._text = ""

    def handle_starttag(self, tag, attrs):
        if tag == "data":
            self._open, self._text = dict(attrs), ""

    def handle_data(self, data):
        if self._open is not None:
            self._text += data

    def handle_endtag(self, tag):
        if tag == "data" and self._open is not None:
            self.found.append((self._open.get("data-pointer") or "", self._open["data-value"], self._text))
            self._open = None


class Written:
    """A written report and what can be read from its files."""

    def __init__(self, paths: dict[str, Path]) -> None:
        self.paths = paths
        self.json = json.loads(paths["json"].read_text(encoding="utf-8"))
        self.html = paths["html"].read_text(encoding="utf-8")

    def numbers(self) -> list[tuple[str, str, str]]:
        parser = Numbers()
        parser.feed(self.html)
        return parser.found

    def at(self, pointer: str):
        value = self.json
        for part in pointer.split("/")[1:]:
            part = part.replace("~1", "/").replace("~0", "~")
            value = value[int(part)] if isinstance(value, list) else value[part]
        return value

    def pdf_text(self) -> str:
        return pdf_text(self.paths["pdf"])


def pdf_text(path: Path) -> str:
    tool = shutil.which("pdftotext")
    if tool is None:
        pytest.skip("pdftotext (poppler-utils) is not installed: the text of the PDF cannot be read back")
    return subprocess.run([tool, "-layout", str(path), "-"], capture_output=True, check=True, text=True).stdout
