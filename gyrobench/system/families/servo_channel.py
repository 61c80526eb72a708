"""One axis of a two-degree-of-freedom gyro along the axis of a table, the other one locked by a rebalance loop.

    class ServoTest(ChannelTest, TableTest): ...

An axis of such a gyro is a single-degree-of-freedom gyro with (I, O, S) = (x, y, z), the x channel, or (y, -x, z), the
y channel.  The option channel says which lies along the table axis; a part with two pickoffs in the slot gyro sets it
to x.  Pickoff and torquer of a channel are not on the same axis: the torquer about y precesses the rotor about x.
[SERVO1-2DOF; Hu 1981, section 3.3, item 6, fig. 3-35, 3-38]
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any, ClassVar

from numpy.typing import ArrayLike

from gyrobench import drift
from gyrobench.system.families.arranged import Arranged
from gyrobench.system.families.option_groups import GYRO_NOISES
from gyrobench.system.families.table_test import ON_TABLE, sampled
from gyrobench.system.part_files import has_port
from gyrobench.system.part_values import PartValues
from gyrobench.system.system import Option, Slot

OTHER = {"x": "y", "y": "x"}
CHANNEL = {
    "channel": Option(
        "", str, "of a two-degree-of-freedom gyro: the axis along the table axis, x or y; empty: a floated gyro"
    )
}
LOCKED = "locked"  # the sampler of the current that locks the other axis
#: gyro axes x, y, z (rows) in table axes, for the channel along the table axis
FACES = {"": ON_TABLE, "x": ON_TABLE, "y": ((-1.0, 0.0, 0.0), (0.0, 0.0, 1.0), (0.0, 1.0, 0.0))}
#: what a servo table is told of a free rotor, which neither lags nor pulls at the table: H/C = 1, hardly any inertia
FREE = {"H_g": 1e-6, "C_g": 1e-6, "J_g": 1e-12, "network": 1}
#: of a floated gyro -> what the table is told of it
GYRO_TO_TABLE = {"H": "H_g", "J": "J_g", "C": "C_g", "K_sg": "K_g"}


def gyro_on_table(parts: PartValues, channel: str = "") -> dict[str, Any]:
    """Return what the design of the table's servo loop takes of the gyro on it."""
    if channel not in OTHER:
        return {f"table.{b}": parts[f"gyro.{a}"] for a, b in GYRO_TO_TABLE.items()}
    told = {f"table.{n}": value for n, value in FREE.items()}
    return {**told, "table.K_g": parts[f"gyro.K_sg_{channel}"]}


def own_name(channel: str, name: str) -> str:
    """Return what a parameter of a floated gyro is called in a channel: K_sg is K_sg_x, k is k_y, D_F is Dx_0."""
    if channel not in OTHER:
        return name
    if name in drift.NAMES:
        return drift.name_2dof(channel, name)
    torquer = name in ("k", "k2", "k3", "k_T")
    each = torquer or name == "K_sg" or name in GYRO_NOISES
    return f"{name}_{OTHER[channel] if torquer else channel}" if each else name


def lock(channel: str) -> str:
    """Return the wires of the loop that locks the axis across ``channel``."""
    other = OTHER[channel]
    return f"""
    gyro -> lock: u_{other}=u u_{channel}=u_cross
    lock -> gyro: i=i_{channel}
    lock -> {LOCKED}: i_read=x saturated=flag
    {sampled(LOCKED)}
    """


def in_channel(wires: str, channel: str) -> str:
    """Return the wires of a test of a floated gyro as those of a channel: u is u_x, i is i_y, and no alpha."""
    lines = []
    for line in wires.splitlines():
        ends, _, ports = line.partition(":")
        source, arrow, target = (part.strip() for part in ends.partition("->"))
        if arrow and source == "gyro":
            ports = _renamed(ports, "u", lambda rest: f"u_{channel}={rest or 'u'}")
        elif arrow and target == "gyro":
            ports = _renamed(ports, "alpha", lambda _: "")
            ports = _renamed(ports, "i", lambda _: f"i=i_{OTHER[channel]}")
        lines.append(f"{ends}:{ports}" if ports else line)
    return "\n".join(lines) + lock(channel)


def _renamed(ports: str, name: str, by: Any) -> str:
    """Return the ports with the one called ``name``, alone or as name=other, by ``by(other)``."""
    out = []
    for port in ports.split():
        first, _, rest = port.partition("=")
        out.append(by(rest) if first == name else port)
    return " " + " ".join(p for p in out if p)


class ChannelTest(Arranged):
    """A test of a floated gyro on a table that takes a channel of a two-degree-of-freedom gyro as well.

    Its options hold :data:`CHANNEL`.  Not modelled: the rate across the table axis times the angle that the locking
    loop leaves, zero with its integral.
    """

    arranged_by = "channel"
    arranged = ("slots", "wires", "channels", "noises", "open", "windows")
    axis_parts: ClassVar[Mapping[str, str]]  # of the slots gyro and lock, unless others are given
    locked_columns: ClassVar[Mapping[str, str]] = {"locked": f"{LOCKED}.mean", "flagged_locked": f"{LOCKED}.flagged"}

    @property
    def channel(self) -> str:
        """Return x or y; "" of a floated gyro."""
        return str(self["channel"])

    @property
    def face(self) -> ArrayLike:
        """Return the gyro axes (rows) in table axes."""
        return FACES.get(self.channel, ON_TABLE)

    def request(self, slot: str) -> None:
        """Add what is asked for; a value of the locking loop asks for a channel."""
        super().request(slot)
        if slot in ("lock", LOCKED) and not self.channel:
            self.set("channel", "x")

    def all_slots(self) -> dict[str, Slot]:
        return {**self.locking(), **super().all_slots()}

    def locking(self) -> dict[str, Slot]:
        """Return the slots of the loop that locks the other axis."""
        return {"lock": Slot("Rebalance", self.axis_parts["lock"]), LOCKED: Slot("Sampler", "sampler")}

    def place(self, slot: str, part: str | Path, bench: Path | None = None) -> None:
        super().place(slot, part, bench)
        if slot == "gyro" and not self.channel and has_port(part, "u_x", bench):
            self.set("channel", "x")

    def arrange(self) -> None:
        c = self.channel
        if c in OTHER:
            slots = {n: s for n, s in self.slots.items() if n not in ("gyro", "sampler")}
            lock = self.locking()
            slots |= {"gyro": Slot("TwoAxisGyro", self.axis_parts["gyro"]), "lock": lock["lock"]}
            slots |= {"sampler": self.slots["sampler"], LOCKED: lock[LOCKED]}
            windows = self.windows
            assert windows is not None
            vars(self).update(
                slots=slots,
                wires=in_channel(self.wires, c),
                channels=tuple(self._port(n) for n in self.channels),
                noises=(*(self._port(n) for n in self.noises), *self._noises_of(OTHER[c]), "lock.meter"),
                open=tuple(n.replace("gyro.i", f"gyro.i_{OTHER[c]}") for n in self.open),
                windows=type(windows)(windows.watch, {**windows.columns, **self.locked_columns}),
            )

    def _port(self, name: str) -> str:
        """Return "gyro.u" as "gyro.u_x", "gyro.markov" as "gyro.markov_x"."""
        slot, _, own = name.partition(".")
        each = own in ("u", "drift", *GYRO_NOISES)
        return f"{name}_{self.channel}" if slot == "gyro" and each else name

    @staticmethod
    def _noises_of(axis: str) -> tuple[str, ...]:
        return tuple(f"gyro.{n}_{axis}" for n in GYRO_NOISES)

    def gyro_drift_of(self, parts: PartValues) -> dict[str, float]:
        """Return the drift coefficients of the channel along the table axis, rad/s per g0^n, in the names of a floated
        gyro.
        """
        found, c = {}, self.channel
        for n in drift.NAMES:
            own = f"gyro.{own_name(c, n)}"
            if own in parts:
                found[n] = drift.sign_2dof(c, n) * float(parts[own])
        return found

    def check(self) -> list[str]:
        problems = super().check()
        if self.channel not in FACES:
            problems.append(f"channel = {self.channel}: x or y of a two-degree-of-freedom gyro, or nothing")
        return problems
