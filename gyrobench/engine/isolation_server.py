"""The child process that holds one isolated FMU: ``python -m gyrobench.engine.isolation_server SLOT FOLDER``.

Protocol on its standard streams, in both directions: four bytes of length, then a marshalled tuple.  A request is
(call, arguments...), an answer ("ok", value) or ("failed", call, status, time, messages).  What the FMU itself prints
goes to standard error.
"""

from __future__ import annotations

import marshal
import os
import struct
import sys
from pathlib import Path
from typing import Any, BinaryIO

from gyrobench.engine.fmu_instance import FmuCallError, LocalSlave
from gyrobench.engine.program import Group
from gyrobench.system.binding import Bound


def send(stream: BinaryIO, message: tuple[Any, ...]) -> None:
    """Writes one message."""
    data = marshal.dumps(message)
    stream.write(struct.pack("<I", len(data)) + data)
    stream.flush()


def receive(stream: BinaryIO) -> tuple[Any, ...]:
    """Reads one message; raises EOFError when the other side is gone."""
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
        self.slave = LocalSlave(slot, description, folder)
        self.groups: dict[int, Group] = {}

    def group(self, number: int, kind: str, references: list[int]) -> None:
        self.groups[number] = Group(kind, references)

    def set_start(self, values: list[tuple[Any, ...]]) -> None:
        self.slave.set_start([(Bound(*b), v) for b, v in values])

    def write(self, number: int, values: list[Any]) -> None:
        group = self.groups[number]
        group.values[:] = values
        self.slave.write(group)

    def read(self, number: int) -> list[Any]:
        group = self.groups[number]
        self.slave.read(group)
        return list(group.values)

    def step(self, writes: list[tuple[int, list[Any]]], t: float, h: float, reads: list[int]) -> list[list[Any]]:
        for number, values in writes:
            self.write(number, values)
        self.slave.do_step(t, h)
        return [self.read(n) for n in reads]

    def handle(self, call: str, *arguments: Any) -> Any:
        own = getattr(self, call, None)
        return own(*arguments) if own is not None else getattr(self.slave, call)(*arguments)


def main() -> None:
    """Serves requests until the parent closes the stream."""
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
