"""Standard streams in any surroundings: closed ones, and encodings that lack letters of the trade."""

from __future__ import annotations

import codecs
import os
import sys
import unicodedata

ASCII = {
    "°": "deg",
    "′": "'",
    "″": '"',
    "−": "-",
    "–": "-",
    "—": "-",
    "…": "...",
    "×": "x",
    "·": ".",
    "±": "+-",
    "√": "sqrt",
}


def spelled(letter: str) -> str:
    """Return a character in ASCII: a Greek letter by its name, others without their accents, else by its code."""
    if letter in ASCII:
        return ASCII[letter]
    name = unicodedata.name(letter, "").split()
    if name[:1] == ["GREEK"] and "LETTER" in name:
        word = name[name.index("LETTER") + 1].lower()
        return word.capitalize() if "CAPITAL" in name else word
    plain = unicodedata.normalize("NFKD", letter).encode("ascii", "ignore").decode()
    return plain or letter.encode("ascii", "backslashreplace").decode()


def _spell(error: UnicodeError) -> tuple[str, int]:
    if not isinstance(error, UnicodeEncodeError):
        raise error
    return "".join(map(spelled, error.object[error.start : error.end])), error.end


def prepare() -> None:
    """Let output go on where a stream is closed, or cannot write a letter: it is spelled."""
    codecs.register_error("gyrobench-spelled", _spell)
    for number, name, mode in ((0, "stdin", "r"), (1, "stdout", "w"), (2, "stderr", "w")):
        if getattr(sys, name) is None:  # closed: the next file that is opened would take its place
            try:
                os.fstat(number)
            except OSError:
                nothing = os.open(os.devnull, os.O_RDWR)
                if nothing != number:
                    os.dup2(nothing, number)
                    os.close(nothing)
            setattr(sys, name, open(number, mode, encoding="utf-8", closefd=False))  # noqa: SIM115
        elif mode == "w" and hasattr(getattr(sys, name), "reconfigure"):
            getattr(sys, name).reconfigure(errors="gyrobench-spelled")
