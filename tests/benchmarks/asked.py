"""What the command line of a benchmark asks for."""

from __future__ import annotations

import argparse
from typing import Any


def asked(about: str | None, *words: str, **options: Any) -> argparse.Namespace:
    """Return what the command line says.  words: names of lists of words; options: --name with its default.

    A default of False makes a switch, a type an option without default, a list one of its words, the first by default;
    (default, text) has a help text.
    """
    parser = argparse.ArgumentParser(description=about, formatter_class=argparse.RawDescriptionHelpFormatter)
    for word in words:
        parser.add_argument(word, nargs="*")
    for name, value in options.items():
        default, text = value if isinstance(value, tuple) else (value, None)
        how: dict[str, Any] = {"type": type(default), "default": default}
        if default is False:
            how = {"action": "store_true"}
        elif isinstance(default, list):
            how = {"choices": default, "default": default[0]}
        elif isinstance(default, type):
            how = {"type": default}
        parser.add_argument(f"--{name}", help=text, **how)
    return parser.parse_args()
