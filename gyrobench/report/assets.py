"""Folders of the templates, styles, schema and specifications of a bench."""

from __future__ import annotations

from pathlib import Path

from gyrobench.bench import standard_folder


def content_dir(bench: Path | None = None, name: str = "templates/report.html.j2") -> Path:
    """Return the ``reports`` folder that holds the content file ``name``: the bench's own before the standard one.

    Raises FileNotFoundError when neither has it.
    """
    candidates = [standard_folder() / "reports"]
    if bench is not None:
        candidates.insert(0, Path(bench) / "reports")
    for folder in candidates:
        if (folder / name).is_file():
            return folder
    looked = ", ".join(str(c) for c in candidates)
    raise FileNotFoundError(f"report content {name!r} not found; looked in {looked}")


def read_content(name: str, bench: Path | None = None) -> str:
    """Text of one content file, the bench's own before the standard one."""
    return (content_dir(bench, name) / name).read_text(encoding="utf-8")
