"""Where the templates, styles, schema and specifications of a bench are."""

from __future__ import annotations

from pathlib import Path

_PACKAGE = Path(__file__).resolve().parents[1]


def content_dir(bench: Path | None = None, name: str = "report.html.j2") -> Path:
    """Folder that holds the content file ``name``.

    ``<bench>/reports`` where it has that file, otherwise the standard bench: ``gyrobench/_bench/reports``
    of an installed wheel, or ``reports/`` of a checkout.  Raises FileNotFoundError when none has it.
    """
    candidates = [_PACKAGE / "_bench" / "reports", _PACKAGE.parent / "reports"]
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
