"""Inputs of every kind with mistakes no one thinks of: what comes back must be a result or an error for a person.

    attack = attacks(folder, "csv")["csv"]     # prepares what it needs in the folder
    fault = attack(seed)                       # None, or the traceback of any other exception

Each input is a valid one (tests/corpus, files of the bench, archives that it builds) with up to five changes: bytes
turned, cut out, doubled, tokens put in that programs trip over, lines exchanged.  A seed is an input.
"""

from __future__ import annotations

import io
import json
import random
import shutil
import tempfile
import traceback
import zipfile
from collections.abc import Callable, Mapping
from functools import partial
from pathlib import Path

import numpy as np
from fuzzed_statements import _axes, _gyro, _mapping, _set, _settings, _spec, _units, changed

from gyrobench import reading
from gyrobench.bench import Bench
from gyrobench.errors import GyrobenchError

HERE = Path(__file__).parents[1]
CORPUS = {f.stem: f.read_bytes() for f in sorted((HERE / "corpus").glob("*.csv"))}
QUICK = ("fixed_position", "open_loop_drift", "pickoff_scale_factor", "tumble_single_axis")  # reduced in 0.1 to 0.3 s
REDUCED = 0.03  # of the files that can be read
Attack = Callable[[int], str | None]


def held(what: Callable[[random.Random], object], seed: int) -> str | None:
    """Return the traceback of an error that is none for a person."""
    try:
        what(random.Random(seed))
    except GyrobenchError as error:
        assert str(error).strip(), "an error without a word"
    except OSError as error:
        if not error.filename:
            return traceback.format_exc()
    except Exception:
        return traceback.format_exc()
    return None


def sealed_again(content: bytes) -> bytes:
    """Return a stored document with the digests of what it holds now, so that a reader takes it; else the bytes."""
    try:
        document = json.loads(content)
        if "report_id" in document:
            rest = {k: v for k, v in document.items() if k not in ("schema", "report_id")}
            return json.dumps({**document, "report_id": reading.digest(rest)[: reading.SHORTEST]}).encode()
        return json.dumps(reading.sealed({k: v for k, v in document.items() if k != reading.SEAL})).encode()
    except (ValueError, AttributeError, TypeError, RecursionError):
        return content


def attacks(folder: Path, *kinds: str) -> dict[str, Attack]:
    """Return the attacks by kind (default: all); files are written into the folder."""
    from fuzzing_of_uses import OF_USES

    every = (
        _csv, _numbers, _series, _set, _settings, _units, _axes, _mapping, _spec, _record, _result, _fmu, _ssp, _other,
        *OF_USES,
    )  # fmt: skip
    wanted = {f.__name__[1:]: f for f in every if not kinds or f.__name__[1:] in kinds}
    return {name: partial(held, prepare(folder)) for name, prepare in wanted.items()}


def _csv(folder: Path) -> Callable[[random.Random], object]:
    from gyrobench.system.system import load_system

    file = folder / "measured.csv"

    def one(rng: random.Random) -> None:
        name = rng.choice(list(CORPUS))
        file.write_bytes(changed(CORPUS[name], rng))
        system = load_system(name)
        record = system.read_measured(file, {})
        if name in QUICK and rng.random() < REDUCED:
            system.reduce(record, None)

    return one


LEGAL = ["0", "-0", "1e15", "-1e15", "1e-300", "1e300", "-1e300", "1", "-1", "3", "7", "0.5", "1e-9", "12345678"]


def _numbers(folder: Path) -> Callable[[random.Random], object]:
    """Tables that can be read, whose numbers make no sense: the reduction finds out."""
    from gyrobench.system.system import load_system

    file = folder / "numbers.csv"

    def one(rng: random.Random) -> None:
        name = rng.choice(QUICK)
        lines = CORPUS[name].decode().splitlines()
        first = 1 + next(k for k, line in enumerate(lines) if not line.startswith("#"))
        head, rows = lines[:first], [line.split(",") for line in lines[first:]]
        for _ in range(rng.randint(1, 4)):
            column, row = rng.randrange(len(rows[0])), rng.randrange(len(rows))
            match rng.randrange(6):
                case 0:
                    rows[row][column] = rng.choice(LEGAL)
                case 1:  # a column of one number
                    value = rng.choice(LEGAL)
                    for cells in rows:
                        cells[column] = value
                case 2 if len(rows) > 2:
                    rows = rows[: rng.randint(1, len(rows))]
                case 3:
                    factor = float(rng.choice(LEGAL))
                    for cells in rows:
                        cells[column] = repr(float(cells[column]) * factor)
                case 4:  # a line of the circumstances
                    k = rng.randrange(max(1, first - 1))
                    head[k] = head[k].split("=")[0] + "= " + rng.choice(LEGAL)
                case _:
                    rng.shuffle(rows)
        file.write_text("\n".join([*head, *(",".join(cells) for cells in rows), ""]), encoding="utf-8")
        system = load_system(name)
        system.reduce(system.read_measured(file, {}), None)

    return one


def _series(folder: Path) -> Callable[[random.Random], object]:
    """Drift records and recorded motions."""
    from gyrobench.record.motion_profile import read_profile
    from gyrobench.system.system import load_system

    rows = [f"{k},{0.1 * ((7 * k) % 13 - 6):.3g},{20 + 0.01 * k:.4g}" for k in range(600)]
    drift = "\n".join(["# samples = means", "time [s],rate [deg/h],temperature [degC]", *rows, ""]).encode()
    motion = b"# instrument = ship\ntime [s],pitch [deg],roll [deg]\n0,0.1,-1\n0.5,0.12,-1.3\n1,0.1,-1.2\n1.5,0,0\n"
    file = folder / "series.csv"

    def one(rng: random.Random) -> None:
        if rng.random() < 0.5:
            file.write_bytes(changed(drift, rng))
            load_system("drift_record").read_measured(file, {})
        else:
            file.write_bytes(changed(motion, rng))
            read_profile(file)

    return one


def _record(folder: Path) -> Callable[[random.Random], object]:
    """Folders of runs: the document, the tables, or the hash made to fit a changed table."""
    from gyrobench.files import sha256
    from gyrobench.record.record import Record
    from gyrobench.system.system import load_system

    system = load_system("fixed_position")
    file = folder / "base.csv"
    file.write_bytes(CORPUS["fixed_position"])
    home = folder / "run"
    system.read_measured(file, {}).save(home)
    files = {f.name: f.read_bytes() for f in sorted(home.iterdir()) if f.is_file()}
    table = next(n for n in files if n.startswith("record."))
    columns = home / "record.csv"

    def one(rng: random.Random) -> None:
        for n, data in files.items():
            (home / n).write_bytes(data)
        columns.unlink(missing_ok=True)
        what = rng.choice(["run.json", table, "honest", "csv"])
        if what in files:
            content = changed(files[what], rng)
            (home / what).write_bytes(sealed_again(content) if what == "run.json" and rng.random() < 0.7 else content)
        else:
            document = json.loads(files["run.json"])
            if what == "csv":
                (home / table).unlink()
                rows = b"phase,t_start,t_end,mean\n" + b"0,0,10,1e-3\n" * 30
                columns.write_bytes(changed(rows, rng))
                document["tables"] = {"record.csv": sha256(columns)}
            else:
                (home / table).write_bytes(changed(files[table], rng))
                document["tables"] = {table: sha256(home / table)}
            del document[reading.SEAL]
            (home / "run.json").write_text(json.dumps(reading.sealed(document)), encoding="utf-8")
        record = Record.load(home)
        if rng.random() < REDUCED:
            system.reduce(record, None)

    return one


def _result(folder: Path) -> Callable[[random.Random], object]:
    from gyrobench.report import result_json
    from gyrobench.system.system import load_system

    system = load_system("fixed_position")
    file = folder / "base.csv"
    file.write_bytes(CORPUS["fixed_position"])
    text = json.dumps(result_json.document(system.reduce(system.read_measured(file, {}), None))).encode()

    def one(rng: random.Random) -> None:
        content = changed(text, rng)
        if rng.random() < 0.7:
            content = sealed_again(content)
        result_json.load(content.decode("utf-8", "replace"))

    return one


def _other(folder: Path) -> Callable[[random.Random], object]:
    """Result files of other tools, of each format."""
    import pyarrow as pa
    import pyarrow.parquet as pq
    from scipy.io import savemat

    from gyrobench.exchange.external_record import ResultReader, find_series
    from gyrobench.exchange.result_files import open_result
    from gyrobench.record.run_document import PlanRow, RunDocument
    from gyrobench.system.binding import Bound
    from gyrobench.system.system import load_system

    system = load_system("fixed_position")
    assert system.windows is not None
    time = np.arange(60) * 0.5
    names = ["sampler.count", *system.windows.columns.values()]
    columns = {n: np.floor(time / 5.0) + 0.1 * k * (n != names[0]) for k, n in enumerate(names)}
    windows = columns["sampler.count"]
    columns |= {
        "sampler.window_phase": np.ones(60),
        "sampler.t_start": 5.0 * windows - 5.0,
        "sampler.t_end": 5.0 * windows,
    }
    table = np.column_stack([time, *columns.values()])
    rows = [",".join(["time", *names]), *(",".join(map(repr, row)) for row in table.tolist()), ""]
    (folder / "a.csv").write_text("\n".join(rows))
    np.save(folder / "b.npy", np.rec.fromarrays([time, *columns.values()], names=["time", *names]))
    pq.write_table(pa.table({"time": time, **columns}), folder / "c.parquet")
    savemat(folder / "d.mat", {"time": time, "sampler": {n.partition(".")[2]: v for n, v in columns.items()}})
    texts = ["time", *names]
    width = max(map(len, texts))
    trajectory = {
        "Aclass": np.array(["Atrajectory", "1.1        ", "           ", "binTrans   "]),
        "name": np.array(["".join(c) for c in zip(*(n.ljust(width) for n in texts), strict=True)]),
        "description": np.array([" " * len(texts)]),
        "dataInfo": np.array([[2, k + 1, 0, -1] for k in range(len(texts))], dtype=np.int32).T,
        "data_1": np.zeros((1, 2)),
        "data_2": table.T,
    }
    savemat(folder / "e.mat", trajectory, format="4")
    files = {f.name: f.read_bytes() for f in sorted(folder.iterdir()) if f.is_file()}
    outputs = {n: ("sampler", Bound(n, n.partition(".")[2], 0, "Real")) for n in names}

    def one(rng: random.Random) -> None:
        [name] = rng.choices(list(files), [1 if n.endswith(".mat") else 5 for n in files])  # a process for each .mat
        (folder / name).write_bytes(changed(files[name], rng))
        result = open_result(folder / name)
        reader = ResultReader(system, result, find_series(result, outputs, set(names), {"sampler"})[0], 0.5)
        reader.read()
        reader.record(RunDocument(step=0.5, plan=[PlanRow(phase=1, window=5.0)]))

    return one


def _zip(parts: Mapping[str, bytes]) -> bytes:
    out = io.BytesIO()
    with zipfile.ZipFile(out, "w") as archive:
        for name, data in parts.items():
            archive.writestr(name, data)
    return out.getvalue()


def _archived(path: Path, names: tuple[str, ...], read: Callable[[Path], object]) -> Callable[[random.Random], object]:
    """Change the XML of an archive, or its bytes."""
    with zipfile.ZipFile(path) as archive:
        parts = {n: archive.read(n) for n in archive.namelist()}
    whole = path.read_bytes()
    target = path.with_name(f"attacked{path.suffix}")

    def one(rng: random.Random) -> None:
        if rng.random() < 0.2:
            target.write_bytes(changed(whole, rng))
        else:
            name = rng.choice([n for n in parts if n.endswith(names)])
            target.write_bytes(_zip({**parts, name: changed(parts[name], rng)}))
        read(target)

    return one


def _fmu(folder: Path) -> Callable[[random.Random], object]:
    from gyrobench.files import unzip_fmu
    from gyrobench.workflow.inputs import check_fmu_files

    def read(fmu: Path) -> None:
        check_fmu_files({"gyro": str(fmu)})
        with tempfile.TemporaryDirectory(dir=folder) as unzipped:
            unzip_fmu(fmu, Path(unzipped))

    return _archived(_gyro(folder), ("modelDescription.xml",), read)


def _ssp(folder: Path) -> Callable[[random.Random], object]:
    from gyrobench.exchange.ssp_export import export_ssp
    from gyrobench.exchange.ssp_import import read_ssp
    from gyrobench.system.system import load_system

    def read(archive: Path) -> None:
        try:
            read_ssp(archive, 1e-3)
        finally:
            for opened in Bench.find().cache.glob("ssp-*"):
                shutil.rmtree(opened)

    path = folder / "system.ssp"
    export_ssp(load_system("open_loop_drift"), path)
    return _archived(path, (".ssd", ".ssv"), read)
