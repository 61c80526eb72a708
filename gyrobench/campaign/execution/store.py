"""The stored campaign: a folder, or a URL that fsspec knows, which any number of commands add to and read.

``campaign.json``    question, definition as given, axes, options, parts, versions
``runs/*.parquet``   one row a run, the same to the bit whatever ran it; a run is known by its ``run``, a hash of all
                     that determines its result
``log/*.parquet``    what differs from one execution to the next: worker, attempts, seconds, date
``kept/<run>/``      record and report of the runs that are kept
``earlier/*.parquet`` rows of runs that the present definition does not have, found again when it does

Columns of ``runs``: run, index (place in the plan), system, seed, data, state, reason, ``in.<axis>``, verdict,
warnings, warning_ids, for each coefficient ``<name>.estimate``, ``.u``, ``.lo``, ``.hi`` (95 % interval), ``.truth``,
and report (path in this folder), for measured data also instrument and date.  A number has its unit in the metadata of
its field.

Every file is on the disk before its name is, and is checked when it is read: the name of a table is the SHA-256 of its
content, campaign.json holds its own.  So a folder is readable at any moment.  One process writes at a time; between
the two steps of a merge a run may stand in two files, with equal rows, and readers take one of them.
"""

from __future__ import annotations

import hashlib
import io
import json
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, Self

import pyarrow as pa
import pyarrow.parquet as pq

from gyrobench import reading
from gyrobench.campaign.execution.row_tables import Row, as_table, concatenated, merge, units_of, with_plan
from gyrobench.errors import GyrobenchError
from gyrobench.files import FolderLock, write_whole
from gyrobench.notebook import MissingPackageError

if TYPE_CHECKING:
    import pandas

SCHEMA = "gyrobench-campaign-1"
FILE = "campaign.json"
LOG = pa.schema(
    {
        "run": pa.string(),
        "worker": pa.string(),
        "attempts": pa.int64(),
        "seconds": pa.float64(),
        "finished_at": pa.string(),
        "tries": pa.string(),
    }
)
OWN = ("runs", "log", "kept", "earlier", "site")  # folders
FILES_BEFORE_MERGE = 50


class CampaignError(GyrobenchError):
    """A campaign that cannot be read, written or executed; the text says why and what to do."""

    exit_code = 3


class Campaign:
    """A stored campaign, to be read.

    definition: the content of campaign.json.  units: column -> unit of its numbers, as in result.json.
    """

    def __init__(self, url: str | Path) -> None:
        self.url = str(url)
        try:
            import fsspec
        except ImportError:
            raise MissingPackageError("campaigns need further packages: pip install 'gyrobench[campaign]'") from None
        self.fs, self.root = fsspec.core.url_to_fs(self.url)
        self.local = Path(self.root) if "file" in _protocols(self.fs) else None
        self.definition: dict[str, Any] = {}
        self.notes: list[str] = []  # on what is stored, for the user
        self.units: dict[str, str] = {}

    @classmethod
    def open(cls, url: str | Path) -> Self:
        """Return a campaign that exists.  Raises CampaignError."""
        campaign = cls(url)
        if not campaign._exists(FILE):
            raise CampaignError(f"{url}: no campaign there (no {FILE})")
        campaign._read_definition()
        campaign.arrow()
        return campaign

    @property
    def name(self) -> str:
        """Name of the campaign."""
        return str(self.definition.get("name", ""))

    @property
    def axes(self) -> list[dict[str, Any]]:
        """Return the axes that are varied: name, kind, unit, values."""
        return list(self.definition.get("axes", []))

    def table(self) -> pandas.DataFrame:
        """Return a row for each run, in the order of the plan; ``attrs["units"]`` holds the units."""
        frame = self.arrow().to_pandas()
        frame.attrs["units"] = dict(self.units)
        return frame

    def log(self) -> pandas.DataFrame:
        """Return how the runs were executed: run, worker, attempts, seconds, finished_at, tries."""
        return concatenated(self._tables("log")).to_pandas()

    def arrow(self) -> pa.Table:
        """Return the rows of the runs as an Arrow table; its units are :attr:`units`."""
        table = merge(self._tables("runs"))
        self.units |= units_of(table)
        return table

    def read(self, path: str) -> bytes:
        """Return a file of the campaign, for example the report of a run.  Raises FileNotFoundError."""
        return bytes(self.fs.cat_file(self._path(path)))

    def _path(self, *names: str) -> str:
        return "/".join([self.root.rstrip("/"), *names])

    def _exists(self, name: str) -> bool:
        return bool(self.fs.exists(self._path(name)))

    def _read_definition(self) -> None:
        try:
            text = self.read(FILE).decode()
        except (OSError, ValueError) as error:
            raise CampaignError(f"{self.url}/{FILE}: not the description of a campaign: {error}") from None
        document = reading.json_object(text, f"{self.url}/{FILE}", CampaignError)
        remedy = "restore it from a copy, or remove it: the command that made the campaign writes it again"
        self.definition, verified = reading.opened(
            document, f"{self.url}/{FILE}", lambda text: CampaignError(f"{text}; {remedy}")
        )
        self.notes = [] if verified else [f"{self.url}/{FILE} has no SHA-256 of its own, so changes to it do not show"]
        if self.definition.get("schema") != SCHEMA:
            raise CampaignError(f"{self.url}/{FILE}: schema {document.get('schema')!r}, expected {SCHEMA!r}")

    def _files(self, folder: str) -> list[str]:
        """Return the Parquet files of a folder; half ones, which a kill leaves, have another suffix."""
        self.fs.invalidate_cache()
        path = self._path(folder)
        if not self.fs.isdir(path):
            return []
        return sorted(f for f in self.fs.ls(path, detail=False) if f.endswith(".parquet"))

    def _tables(self, folder: str) -> list[pa.Table]:
        tables = []
        for file in self._files(folder):
            remedy = "remove the file: the runs in it are run again"
            try:
                content = self.fs.cat_file(file)
                if _name_of(content) != file.rpartition("/")[2]:
                    raise CampaignError(f"{file}: changed after it was saved (its SHA-256 is not its name); {remedy}")
                tables.append(pq.read_table(io.BytesIO(content)))
            except (OSError, pa.ArrowException) as error:
                raise CampaignError(f"{file}: not readable: {error}; {remedy}") from None
        return tables


class CampaignStore(Campaign):
    """A campaign that is written, by one process at a time; a context manager that holds the lock of a folder.

    with CampaignStore("out/lot") as store:
        done = store.begin(document, plan)     # rows of an earlier definition are put aside or found again
        store.append(rows, units, log)         # on disk when it returns
        store.consolidate()                    # one file, sorted
    """

    def __init__(self, url: str | Path) -> None:
        super().__init__(url)
        self._lock: FolderLock | None = None

    def __enter__(self) -> Self:
        if self.local is not None:
            self.local.mkdir(parents=True, exist_ok=True)
            self._lock = FolderLock(self.local)
        return self

    def __exit__(self, *_: object) -> None:
        if self._lock is not None:
            self._lock.release()
            self._lock = None

    def begin(
        self, document: Mapping[str, Any], plan: Mapping[str, Row], units: Mapping[str, str] | None = None
    ) -> dict[str, str]:
        """Write campaign.json and return the state of each run of the plan that has a row: run -> state.

        plan: run -> the columns that the plan knows ("index", "in.<axis>", ...), which the rows get anew.  units: of
        these columns.  Rows of other runs go to earlier/.  Raises CampaignError where the folder holds something else.
        """
        if self._exists(FILE):
            self._read_definition()
        elif self.local is not None and any(p.name not in OWN and p.name[:1] != "." for p in self.local.iterdir()):
            raise CampaignError(f"{self.url}: holds other files; name a new folder")
        self.definition = json.loads(json.dumps({"schema": SCHEMA, **document}, allow_nan=False))
        text = json.dumps(reading.sealed(self.definition), indent=1, ensure_ascii=False) + "\n"
        self._write(FILE, text.encode("utf-8", "backslashreplace"))
        table = self._arrange(plan, units or {})
        self.units = {**units_of(table), **(units or {})}
        return dict(zip(table.column("run").to_pylist(), table.column("state").to_pylist(), strict=True))

    def _arrange(self, plan: Mapping[str, Row], units: Mapping[str, str]) -> pa.Table:
        """Sort what is stored into runs of the plan and others; return the rows of the plan."""
        files = {folder: self._files(folder) for folder in ("runs", "earlier")}
        table = merge([t for folder in files for t in self._tables(folder)])
        wanted = [run in plan for run in table.column("run").to_pylist()]
        planned = with_plan(table.filter(pa.array(wanted, pa.bool_())), plan, units)
        others = table.filter(pa.array([not w for w in wanted], pa.bool_()))
        for folder, content in (("runs", planned), ("earlier", others)):
            file = self._write_table(folder, content) if content.num_rows else ""
            files[folder] = [f for f in files[folder] if f != file]
        for file in (*files["runs"], *files["earlier"]):
            self.fs.rm_file(file)
        return planned

    def forget(self, states: Iterable[str]) -> list[str]:
        """Remove the rows of runs that ended in one of these states; return them.  They are then run again."""
        files, gone = self._files("runs"), set(states)
        table = self.arrow()
        stays = [s not in gone for s in table.column("state").to_pylist()]
        forgotten = [r for r, s in zip(table.column("run").to_pylist(), stays, strict=True) if not s]
        if forgotten:
            self._replace(files, "runs", table.filter(pa.array(stays, pa.bool_())))
        return forgotten

    def _replace(self, files: Iterable[str], folder: str, table: pa.Table) -> None:
        """Write a table in the place of files."""
        whole = self._write_table(folder, table)
        for file in files:
            if file != whole:
                self.fs.rm_file(file)

    def append(self, rows: Sequence[Row], units: Mapping[str, str], log: Sequence[Row] = ()) -> None:
        """Add rows; they are stored when this returns.  units: column -> unit; log: rows of log/."""
        if not rows:
            return
        for column, unit in units.items():
            if self.units.setdefault(column, unit) != unit:
                raise CampaignError(f"{column}: in {unit} here, in {self.units[column]} in other runs")
        if log:
            self._write_table("log", pa.Table.from_pylist(list(log), schema=LOG))
        self._write_table("runs", as_table(rows, self.units))
        if len(self._files("runs")) > FILES_BEFORE_MERGE:
            self.consolidate()

    def keep(self, run: str, files: Mapping[str, bytes]) -> None:
        """Store the files of a run: name -> content."""
        for name, content in files.items():
            self._write(f"kept/{run}/{name}", content)

    def consolidate(self) -> None:
        """Merge the files of the runs, and those of the log, into one each; the runs sorted, with the kept reports."""
        if files := self._files("runs"):
            table = self.arrow()
            kept = self._path("kept")
            names = {f.rpartition("/")[2] for f in self.fs.ls(kept, detail=False)} if self.fs.isdir(kept) else set()
            paths = [f"kept/{r}/report.html" if r in names else None for r in table.column("run").to_pylist()]
            paths = [p if p and self._exists(p) else None for p in paths]
            k = table.schema.get_field_index("report")
            self._replace(files, "runs", table.set_column(k, table.field(k), [pa.array(paths, pa.string())]))
        if len(files := self._files("log")) > 1:
            self._replace(files, "log", concatenated(self._tables("log")))
        if self.local is not None:
            for folder in ("runs", "log"):
                for half in set((self.local / folder).glob("*")) - set((self.local / folder).glob("*.parquet")):
                    half.unlink()  # of a writer that was killed; this one holds the lock

    def _write_table(self, folder: str, table: pa.Table) -> str:
        """Write a table under a name that its content gives it, and return its path."""
        buffer = io.BytesIO()
        pq.write_table(table, buffer, compression="zstd")
        content = buffer.getvalue()
        name = f"{folder}/{_name_of(content)}"
        self._write(name, content)
        return self._path(name)

    def _write(self, name: str, content: bytes) -> None:
        if self.local is None:
            self.fs.pipe_file(self._path(name), content)  # of an object store: there whole or not at all
            return
        path = self.local / name
        path.parent.mkdir(parents=True, exist_ok=True)
        write_whole(path, content)


def _name_of(content: bytes) -> str:
    """Return the name of a table, which is its digest."""
    return f"{hashlib.sha256(content).hexdigest()[:16]}.parquet"


def _protocols(fs: Any) -> tuple[str, ...]:
    return (fs.protocol,) if isinstance(fs.protocol, str) else tuple(fs.protocol)
