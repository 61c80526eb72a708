"""What is stated, made wrong at random: options, settings, units, axes of campaigns, mapping files, specifications."""

from __future__ import annotations

import random
import shutil
from collections.abc import Callable, Mapping
from pathlib import Path

from gyrobench.bench import Bench

NASTY = [
    b"", b" ", b"\n", b"\r\n", b"\t", b"\0", b"\xff", b"\xfe\xff", b"\xef\xbb\xbf", "é١µ".encode(), b"nan",
    b"NaN", b"inf", b"-inf", b"1e999", b"-1e999", b"1e-999", b"1e308", b"-0.0", b"0", b"-1", b"1e15", b"9" * 400,
    b"1" + b"0" * 5000, b"0x10", b"1_000", b"1,5", b"1;5", b"true", b"null", b"None", b"[", b"]", b"{", b"}",
    b"[" * 3000, b'{"a":' * 2000, b'"', b"'", b"#", b"=", b",", b";", b"|", b"/", b"..", b"../../etc/passwd", b"%s%n",
    b"deg", b"deg/h", b"K^99", b"m2" * 200, b"1deg/0s", b"<", b">", b"&", b"<![CDATA[",
    b"<!DOCTYPE a [<!ENTITY b 'c'>]>", b"a" * 20000, b"\xed\xa0\x80",
    b"(" * 3000, b"sqrt(" * 3000, b"9" * 5000, b" " * 20000, b"..", b":", b"uniform(",
]  # fmt: skip


def changed(data: bytes, rng: random.Random) -> bytes:
    """Return data with one to five changes."""
    for _ in range(rng.randint(1, 5)):
        size = len(data)
        at = rng.randrange(size + 1)
        match rng.randrange(9):
            case 0:
                data = data[:at] + rng.choice(NASTY) + data[at:]
            case 1:
                data = data[:at] + rng.choice(NASTY) + data[at + rng.randint(1, 12) :]
            case 2 if size:
                at = rng.randrange(size)
                data = data[:at] + bytes([data[at] ^ (1 << rng.randrange(8))]) + data[at + 1 :]
            case 3:
                data = data[:at]
            case 4:
                end = at + rng.randint(1, 200)
                data = data[:end] + data[at:]
            case 5:
                data = data[:at] + data[at + rng.randint(1, 200) :]
            case 6 | 7:  # a token: what stands between two separators
                marks = [k for k, c in enumerate(data[:4000]) if c in b' ,;=\n[]{}"<>/']
                if len(marks) > 1:
                    k = rng.randrange(len(marks) - 1)
                    data = data[: marks[k] + 1] + rng.choice(NASTY) + data[marks[k + 1] :]
            case _:
                lines = data.split(b"\n")
                a, b = rng.randrange(len(lines)), rng.randrange(len(lines))
                lines[a], lines[b] = lines[b], lines[a]
                data = b"\n".join(lines)
    return data


def _gyro(folder: Path) -> Path:
    from gyrobench.packaging.fmu import build

    return Path(shutil.copy(build("floated_gyro"), folder / "gyro.fmu"))


def _texts(options: Mapping[str, object]) -> list[bytes]:
    defaults = [str(getattr(o, "default", "")) for o in options.values()]
    return [t.encode() for t in [*defaults, "45.75deg", "0.3deg/h", "[1, 2, 3]", "2mA", "17.2deg/h/mA", "1e-3", "E U"]]


def _set(folder: Path) -> Callable[[random.Random], object]:
    from gyrobench.system.system import load_system

    names = [n for n in Bench.find().systems() if n != "drift_test_suite"]

    def one(rng: random.Random) -> None:
        system = load_system(rng.choice(names))
        option = rng.choice([*system.options, "gyro.D_I", "site.latitude", "table.x[1]", "no.such"]).encode()
        if rng.random() < 0.1:
            option = changed(option, rng)
        value = changed(rng.choice(_texts(system.options)), rng).decode("utf-8", "replace")
        system.set(option.decode("utf-8", "replace"), value)
        system.refuse()

    return one


def _settings(folder: Path) -> Callable[[random.Random], object]:
    from gyrobench.commands.arguments import read_settings
    from gyrobench.system.system import load_system
    from gyrobench.workflow.settings import apply_values

    text = b'latitude = "45.75deg"\nheight = 12.5\nattitude = "E U"\n[gyro]\nwhite = 9e-8\nD_I = "1deg/h/g"\n'
    file = folder / "settings.toml"

    def one(rng: random.Random) -> None:
        file.write_bytes(changed(text, rng))
        apply_values(load_system("fixed_position"), read_settings(file))

    return one


def _units(folder: Path) -> Callable[[random.Random], object]:
    from gyrobench import units

    texts = [b"deg/h/sqrt(Hz)", b"N.m/sqrt(Hz)", b"kg.m2", b"deg/h/g2", b"ug", b"arcsec", b"1e-3", b"rad/s/A", b"degC"]

    def one(rng: random.Random) -> None:
        name = changed(rng.choice(texts), rng).decode("utf-8", "replace")
        units.parse_quantity(f"1.5{name}", rng.choice(texts).decode()) if rng.random() < 0.5 else units.unit(name)

    return one


def _axes(folder: Path) -> Callable[[random.Random], object]:
    """Values of --over."""
    from gyrobench.campaign.execution.axes import Distribution, draw, parse_axis

    texts = [
        b"0deg..80deg:9",
        b"1e-3..1:7log deg/h",
        b"0.1,0.3,1 deg/h/g",
        b"uniform(-1, 1) deg/h",
        b"a,b",
        b"normal(0, 2)",
    ]

    def one(rng: random.Random) -> None:
        axis = parse_axis("latitude", changed(rng.choice(texts), rng).decode("utf-8", "replace"))
        if isinstance(axis, Distribution):
            draw([axis], 4)

    return one


def _mapping(folder: Path) -> Callable[[random.Random], object]:
    from fmpy import read_model_description

    from gyrobench.system import sockets
    from gyrobench.system.binding import fit
    from gyrobench.system.mapping_files import load_mapping
    from gyrobench.system.system import load_system

    description = read_model_description(str(_gyro(folder)), validate=False)
    socket = sockets.socket(load_system("fixed_position").slots["gyro"].socket)
    text = (
        b'[inputs.omega]\nnames = ["omega[1]", "omega[2]", "omega[3]"]\nunit = "rad/s"\nfactor = 1.0\n'
        b'[outputs.u]\nname = "u"\nunit = "V"\noffset = 0.0\n[constants]\nk = "17.2deg/h/mA"\n'
    )
    file = folder / "mapping.toml"

    def one(rng: random.Random) -> None:
        file.write_bytes(changed(text, rng))
        fit(socket, description, load_mapping(file), "gyro")

    return one


def _spec(folder: Path) -> Callable[[random.Random], object]:
    from gyrobench.report.specification import check_units, load_specification

    texts = [f.read_bytes() for f in sorted(Bench.find().specifications().values())]
    file = folder / "spec.toml"

    def one(rng: random.Random) -> None:
        file.write_bytes(changed(rng.choice(texts), rng))
        load_specification(file)
        check_units(file, {"D_I": "°/h/g", "D_F": "°/h"})

    return one
