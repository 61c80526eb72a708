"""The child process that holds one isolated FMU: ``python -m gyrobench.engine.isolation_server SLOT FOLDER``.

Protocol on its standard streams, in both directions: four bytes of length, then a marshalled tuple.  A request is
(call, arguments...), a reply ("ok", value) or ("failed", call, status, time, messages).  What the FMU itself prints
goes to standard error.
"""

from __future__ import annotations

import marshal
import os
import struct
import sys
from pathlib import Path
from typing import Any, BinaryIO

from gyrobench.engine.fmu_instance import FmuCallError, LocalInstance
from gyrobench.engine.program import VariableGroup
from gyrobench.system.binding import Bound


def send(stream: BinaryIO, message: tuple[Any, ...]) -> None:
    """Write one message."""
    data = marshal.dumps(message)
    stream.write(struct.pack("<I", len(data)) + data)
    stream.flush()


def receive(stream: BinaryIO) -> tuple[Any, ...]:
    """Return the next message.  Raises EOFError when the other side is gone."""
    head = stream.read(4)
    if len(head) < 4:
        raise EOFError
    data = stream.read(struct.unpack("<I", head)[0])
    message: tuple[Any, ...] = marshal.loads(data)
    return message


class _Server:
    def __init__(self, slot: str, folder: Path) -> None:
        from fmpy import read_model_description

        description = read_model_description(str(folder), validate=False)
        self.instance = LocalInstance(slot, description, folder)
        self.groups: dict[int, VariableGroup] = {}

    def group(self, number: int, kind: str, references: list[int]) -> None:
        self.groups[number] = VariableGroup(kind, references)

    def set_start(self, values: list[tuple[Any, ...]]) -> None:
        self.instance.set_start([(Bound(*b), v) for b, v in values])

    def write(self, number: int, values: list[Any]) -> None:
        group = self.groups[number]
        group.values[:] = values
        self.instance.write(group)

    def read(self, number: int) -> list[Any]:
        group = self.groups[number]
        self.instance.read(group)
        return list(group.values)

    def step(self, writes: list[tuple[int, list[Any]]], t: float, h: float, reads: list[int]) -> list[list[Any]]:
        for number, values in writes:
            self.write(number, values)
        self.instance.do_step(t, h)
        return [self.read(n) for n in reads]

    def handle(self, call: str, *arguments: Any) -> Any:
        method = getattr(self, call, None)
        return method(*arguments) if method is not None else getattr(self.instance, call)(*arguments)


def main() -> None:
    """Serve requests until the parent closes the stream."""
    out = os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)  # prints of the FMU do not disturb the protocol
    requests = sys.stdin.buffer
    server: _Server | None = None
    while True:
        try:
            call, *arguments = receive(requests)
        except EOFError:
            return
        try:
            if server is None:
                server = _Server(sys.argv[1], Path(sys.argv[2]))
            send(out, ("ok", server.handle(call, *arguments)))
        except FmuCallError as error:
            send(out, ("failed", error.call, error.status, error.time, error.messages))
        except Exception as error:
            send(out, ("failed", call, f"{type(error).__name__}: {error}", None, []))


if __name__ == "__main__":
    main()
