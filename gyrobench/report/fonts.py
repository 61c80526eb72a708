"""Fonts for texts beyond the bench's own: names in any script, from the fonts of the machine, never as empty boxes.

The report is set in Libertinus Serif and DejaVu Sans, which hold Latin, Greek, Cyrillic and the signs of units.  For a
character that DejaVu Sans does not have (测, ア, ม) the fonts of the bench (``reports/fonts``), then those of the
system are looked through.
"""

from __future__ import annotations

import functools
from collections.abc import Collection, Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path

from gyrobench.errors import GyrobenchError

OWN = "DejaVu Sans"
FOLDER = "fonts"  # in reports/ of a bench
KINDS = (".ttf", ".otf", ".ttc", ".otc")
FACES = {"zh": " SC"}  # of a collection the face whose characters have the form of a language: 直 and 骨 differ


class MissingFontError(GyrobenchError):
    """Characters that no font of bench and machine has."""


@dataclass(frozen=True)
class Font:
    """A font file and the name of its family (of a collection that of its first face)."""

    path: Path
    family: str

    def of(self, language: str) -> Font:
        """Return the face of a collection for a language, itself where it has none."""
        from matplotlib.ft2font import FT2Font

        if not (ending := FACES.get(language)):
            return self
        faces = (FT2Font(str(self.path), face_index=k) for k in range(FT2Font(str(self.path)).num_faces))
        return next((Font(self.path, f.family_name) for f in faces if f.family_name.endswith(ending)), self)

    @property
    def files(self) -> list[Path]:
        """The file, and that of the bold font beside it where there is one."""
        bold = self.path.with_name(self.path.name.replace("Regular", "Bold"))
        return [self.path, bold] if bold != self.path and bold.is_file() else [self.path]


def fonts_for(texts: Iterable[str], bench: Path | None = None, language: str = "") -> list[Font]:
    """Return the fonts that are needed for texts beyond DejaVu Sans, few and plain ones first; mostly none.

    language: in whose form characters are drawn that several share.  Raises MissingFontError with the characters that
    no font has.
    """
    left = {c for c in set("".join(texts)) if c.isprintable() and ord(c) not in _own()}
    found: list[Font] = []
    if not left:
        return found
    candidates = [(font, left & charset) for font, charset in _machine(_folder(bench)) if left & charset]
    while left:
        font, has = max(candidates, key=lambda c: len(c[1] & left), default=(None, frozenset[str]()))
        if font is None or not has & left:
            raise MissingFontError(_missing(left))
        found.append(font.of(language))
        left -= has
    return found


def _missing(characters: Collection[str]) -> str:
    some = "".join(sorted(characters)[:12])
    return (
        f"no font of this machine has {some}{' ...' if len(characters) > 12 else ''}; they would be empty boxes. "
        "Install one that has (Debian: apt install fonts-noto-core fonts-noto-cjk), or put its file into reports/fonts "
        "of the bench"
    )


def _folder(bench: Path | None) -> Path | None:
    folder = None if bench is None else Path(bench) / "reports" / FOLDER
    return folder if folder is not None and folder.is_dir() else None


@functools.cache
def _own() -> frozenset[int]:
    import matplotlib
    from matplotlib.ft2font import FT2Font

    return frozenset(FT2Font(str(Path(matplotlib.get_data_path()) / "fonts" / "ttf" / "DejaVuSans.ttf")).get_charmap())


@functools.cache
def _machine(folder: Path | None) -> Sequence[tuple[Font, frozenset[str]]]:
    """Return the fonts of a folder, then those of the system, with the characters each has; upright before others."""
    from matplotlib.font_manager import findSystemFonts
    from matplotlib.ft2font import FT2Font

    own = sorted(p for p in folder.iterdir() if p.suffix.lower() in KINDS) if folder else []
    system = sorted(map(Path, findSystemFonts()), key=lambda p: (not _plain(p), "serif" not in p.stem.lower(), p.name))
    fonts = []
    for path in (*own, *system):
        try:
            face = FT2Font(str(path))
            fonts.append((Font(path, face.family_name), frozenset(map(chr, face.get_charmap()))))
        except (OSError, RuntimeError, ValueError):
            continue  # one that FreeType cannot read
    return fonts


def _plain(path: Path) -> bool:
    return not any(word in path.stem.lower() for word in ("bold", "italic", "oblique", "light", "black", "thin"))
