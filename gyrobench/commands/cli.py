"""The command line: the application with all commands, and how it ends."""

from __future__ import annotations

import gc
import importlib
import os
import signal
import sys
import traceback

from gyrobench.commands import streams
from gyrobench.commands.app import app
from gyrobench.reading import visible
from gyrobench.side_by_side import ONE_THREAD
from gyrobench.workflow.user_errors import exit_code, user_message

for module in (
    "bench", "run", "campaign", "tuning", "identification", "bearing", "exchange", "learn", "studio",
):  # in the order of the help  # fmt: skip
    importlib.import_module(f"gyrobench.commands.{module}_commands")


def main() -> None:
    """Run a command; an error ends in one message and an exit code, with a traceback if GYROBENCH_TRACEBACK=1."""
    streams.prepare()
    for name in ONE_THREAD:
        os.environ.setdefault(name, "1")
    gc.set_threshold(50_000, 20, 20)  # what is imported stays: looking for garbage among it took 6 % of a report
    for name in ("SIGTERM", "SIGHUP"):  # as Ctrl-C: files that are being written are finished or removed
        if hasattr(signal, name) and signal.getsignal(getattr(signal, name)) is signal.SIG_DFL:
            signal.signal(getattr(signal, name), signal.default_int_handler)
    try:
        app(prog_name="gyrobench", standalone_mode=True)
    except KeyboardInterrupt:
        print("gyrobench: interrupted", file=sys.stderr)
        sys.exit(130)
    except Exception as error:
        code = exit_code(error)
        if code is None:
            raise
        if os.environ.get("GYROBENCH_TRACEBACK"):
            traceback.print_exception(error)
        print(f"gyrobench: {visible(user_message(error))}", file=sys.stderr)
        sys.exit(code)


if __name__ == "__main__":
    main()
