"""Part -> FMU: what goes into the archive, and the cache by content."""

from __future__ import annotations

import functools
import hashlib
import importlib.metadata
import shutil
import tempfile
import zipfile
from pathlib import Path

from gyrobench.bench import Bench
from gyrobench.component import Component
from gyrobench.files import make_once, sha256, write_whole
from gyrobench.packaging import compiler, native_target, python_target
from gyrobench.packaging.description import c_units, model_description, summary
from gyrobench.packaging.description3 import build_description, model_description3
from gyrobench.packaging.documentation import index_page, licence_text, licences, terminals
from gyrobench.packaging.icon import icon, kind_of
from gyrobench.packaging.loading import BuildError, load_part, sources
from gyrobench.packaging.native_library import make_library
from gyrobench.packaging.own_controller import is_controller
from gyrobench.user_code import blamed

EPOCH = (1980, 1, 1, 0, 0, 0)  # every zip entry: the same content gives the same file


def content_hash(*texts: str) -> str:
    """Return the SHA-256 of texts."""
    h = hashlib.sha256()
    for t in texts:
        h.update(t.encode() + b"\0")
    return h.hexdigest()


def guid_of(digest: str) -> str:
    """Return the GUID that stands for a digest."""
    return "-".join((digest[:8], digest[8:12], digest[12:16], digest[16:20], digest[20:32]))


@functools.cache
def _tool_hash() -> str:
    """Return the hash of all files whose text determines what a build writes; they stay while the process runs."""
    here = Path(__file__).parent
    after = ("__init__", "instance", "linked_parts", "reference", "validate")  # these use what was built
    files = [f for f in sorted(here.glob("*.py")) if f.stem not in after] + sorted(here.glob("*.[ch]"))
    files = [f for f in files if f.name != "system_core.h"] + [*python_target.RUNTIME, here.parent / "units.py"]
    return content_hash(*(f.read_text(encoding="utf-8") for f in files))


def _content(cls: type[Component], name: str, target: str, fmi: int) -> str:
    """Return the hash of all that determines what an FMU computes."""
    texts = [f"{n}\n{f.read_text(encoding='utf-8')}" for n, f in sources(cls).items()]
    beside = (cls._outside.unit, cls._outside.glue) if cls._outside is not None else ()
    return content_hash(*texts, _tool_hash(), target, str(fmi), name, *beside)


def native_guid(name: str, cls: type[Component]) -> str:
    """Return the GUID of the native FMU (FMI 2.0) that a build of this part makes now."""
    return guid_of(_content(cls, name, "native", 2))


def write_archive(path: Path, entries: dict[str, bytes], durable: bool = True) -> None:
    """Write a zip archive; the same entries give the same file."""

    def write(temporary: Path) -> None:
        with zipfile.ZipFile(temporary, "w", zipfile.ZIP_DEFLATED) as z:
            for name in sorted(entries):
                info = zipfile.ZipInfo(name, EPOCH)
                info.compress_type = zipfile.ZIP_DEFLATED
                info.external_attr = 0o644 << 16
                z.writestr(info, entries[name])

    path.parent.mkdir(parents=True, exist_ok=True)
    write_whole(path, write, durable)  # a build that is stopped leaves no half file


def native_entries(files: dict[str, str], name: str, platforms: tuple[str, ...], fmi: int) -> dict[str, bytes]:
    """Return sources and compiled binaries as entries of an FMU.  Raises CompilerError."""
    entries = {f"sources/{n}": t.encode() for n, t in files.items()}
    with tempfile.TemporaryDirectory() as folder:
        for platform in platforms:
            suffix = compiler.PLATFORMS[platform][0]
            library = Path(folder) / f"{name}-{platform}{suffix}"
            make_library(files, name, fmi, platform, library)
            entries[f"binaries/{_folder_of(platform, fmi)}/{name}{suffix}"] = library.read_bytes()
    return entries


def _folder_of(platform: str, fmi: int) -> str:
    """Return the name of a platform in an FMI version: linux64 in FMI 2, x86_64-linux in FMI 3."""
    three = {"linux64": "x86_64-linux", "win64": "x86_64-windows", "darwin64": "x86_64-darwin"}
    return three.get(platform, platform) if fmi == 3 else platform


def _python_entries(cls: type[Component], guid: str, name: str) -> dict[str, bytes]:
    module, files = python_target.resources(cls, guid)
    entries = {f"resources/{n}": t.encode() for n, t in files.items()}
    entries["resources/slavemodule.txt"] = module.encode()
    # not by import: a Python FMU that ran in this process has put its own copy first on the path
    root = Path(str(importlib.metadata.distribution("pythonfmu").locate_file("pythonfmu")))
    for f in root.glob("*.py"):
        entries[f"resources/pythonfmu/{f.name}"] = f.read_bytes()
    libraries = [f for f in (root / "resources" / "binaries").rglob("*") if f.suffix in (".so", ".dll", ".dylib")]
    if not libraries:
        raise BuildError(f"{root} holds no libraries: install pythonfmu again")
    for f in libraries:
        entries[f"binaries/{f.parent.name}/{name}{f.suffix}"] = f.read_bytes()
    return entries


def largest(file: Path) -> dict[str, float]:
    """Return the largest magnitude of each column of a reference run; nothing where there is no such file."""
    if not file.is_file():
        return {}
    lines = [line.split(",") for line in file.read_text(encoding="utf-8").splitlines() if not line.startswith("#")]
    columns = zip(*lines, strict=False)
    return {name: max((abs(float(x)) for x in values), default=0.0) for name, *values in columns if name != "time"}


def build(
    part: str | type[Component],
    target: str = "native",
    fmi: int = 2,
    out: Path | None = None,
    bench: Path | None = None,
    platforms: tuple[str, ...] = (),
) -> Path:
    """Builds a part and returns the path of its FMU; an unchanged part is taken from the cache.

    The file is ``<out or bench/fmus>/<name>[-python][-fmi3].fmu``.  Raises BuildError, SubsetError (an
    equation outside the subset) and CompilerError.
    """
    if target not in ("native", "python"):
        raise BuildError(f"target {target!r}: one of native, python")
    file = isinstance(part, str) and is_controller(part)
    if fmi not in (2, 3) or (fmi == 3 and target == "python"):
        raise BuildError(f"FMI {fmi} {target}: there are FMI 2 native, FMI 2 python, FMI 3 native")
    platforms = platforms or (compiler.this_platform(),)
    cls = load_part(part, bench) if isinstance(part, str) else part
    name = part if isinstance(part, str) and not file else sources(cls)["model"].parent.name
    identifier = name
    if file and str(part).endswith(".py"):
        target, fmi = "python", 2
    if cls._outside is not None and target == "python":
        raise BuildError(f"{part}: a controller in C is built as a native FMU")
    with blamed(sources(cls)["model"]):
        what = _content(cls, name, target, fmi)
    readme = sources(cls)["model"].parent / "README.md"
    documentation = readme.read_text(encoding="utf-8") if readme.exists() else ""
    sizes = largest(readme.with_name("reference.csv"))
    if target == "native":
        how = "".join(p + compiler.identity(p) for p in platforms)
    else:
        how = importlib.metadata.version("pythonfmu")
    guid = guid_of(what)
    home = Bench.find(bench)
    suffix = ("-python" if target == "python" else "") + ("-fmi3" if fmi == 3 else "")
    cached = (
        home.cache / f"{name}{suffix}-{content_hash(what, how, documentation, licence_text(), repr(sizes))[:20]}.fmu"
    )

    def write(path: Path) -> None:
        if target == "native":
            files = native_target.source_files(cls, guid, fmi)
            entries = native_entries(files, identifier, platforms, fmi)
        else:
            entries = _python_entries(cls, guid, identifier)
        if fmi == 3:
            entries["sources/buildDescription.xml"] = build_description(identifier, c_units(cls)).encode()
            entries["modelDescription.xml"] = model_description3(cls, guid, identifier, sizes).encode()
            entries |= terminals(cls)
        else:
            entries["modelDescription.xml"] = model_description(cls, guid, identifier, target, sizes).encode()
        entries |= index_page(name, summary(cls), cls.__doc__ or "", cls.layout) | licences(target == "python")
        entries |= icon(kind_of(cls), fmi)
        if documentation:
            entries["documentation/README.md"] = documentation.encode()
        write_archive(path, entries, durable=False)

    with blamed(sources(cls)["model"]):
        make_once(cached, write)
    if file and out is None:
        return cached  # two files of one name may stand in one system
    path = (out or home.fmus) / f"{name}{suffix}.fmu"
    if not path.exists() or sha256(path) != sha256(cached):
        path.parent.mkdir(parents=True, exist_ok=True)
        write_whole(path, lambda temporary: shutil.copyfile(cached, temporary))
    return path
