"""Files that are written whole or not at all, their digests, and the files of an FMU."""

from __future__ import annotations

import contextlib
import errno
import functools
import hashlib
import os
import secrets
import shutil
import sys
import tempfile
import zipfile
from collections.abc import Callable, Iterator
from multiprocessing.util import Finalize
from pathlib import Path

from gyrobench import reading
from gyrobench.errors import GyrobenchError

LOCK = ".lock"
TEMPORARY = "gyrobench-temporary-"  # no user names a folder so


def missing(path: Path) -> str:
    """Return why a path names no file, for a message."""
    return "a folder, where a file is expected" if path.is_dir() else "no such file"


def write_whole(path: Path, content: bytes | Callable[[Path], object], durable: bool = True) -> None:
    """Write a file under a temporary name beside ``path`` and rename it; a failure leaves the old file as it was.

    content: of the file, or a function that writes it to the path it is given.  durable: the content is on the disk
    before its name, and both are when this returns, whatever happens to the machine; not for what is made again.
    """
    temporary = path.with_name(f"{path.name}{secrets.token_hex(4)}.part")
    try:
        temporary.touch(0o600, exist_ok=False)
        if isinstance(content, bytes):
            temporary.write_bytes(content)
        else:
            content(temporary)
        os.chmod(temporary, 0o644)
        if durable:
            to_disk(temporary)
        os.replace(temporary, path)
        if durable and os.name != "nt":  # there a folder cannot be opened
            to_disk(path.parent)
    except OSError as error:
        if error.filename in (None, str(temporary)):
            error.filename = str(path)  # for the message: a full disk, a limit of the size, a folder that is read only
        raise
    finally:
        temporary.unlink(missing_ok=True)


def to_disk(path: Path) -> None:
    """Wait until a file, or the names in a folder, are on the disk; some file systems cannot say."""
    handle = os.open(path, os.O_RDONLY if path.is_dir() else os.O_RDWR)
    try:
        os.fsync(handle)
    except OSError as error:
        if error.errno != errno.EINVAL:
            raise
    finally:
        os.close(handle)


def make_once(path: Path, make: Callable[[Path], object]) -> Path:
    """Return ``path``; where there is no such file, ``make(path)`` writes it whole, in one process at a time.

    The others that want the same file wait for it.  For files of a cache, whose names say what they hold.  Its digest
    lies beside it and is checked each time; a file that does not have it any more is made again.
    """
    if not is_intact(path):
        path.parent.mkdir(parents=True, exist_ok=True)
        with _turn(path.with_name(path.name + LOCK)):
            if not is_intact(path):
                make(path)
                digest = sha256(path).encode("ascii")
                write_whole(_digest_of(path), digest, durable=False)
    return path


def _digest_of(path: Path) -> Path:
    return path.with_name(path.name + ".sha256")


def is_intact(path: Path) -> bool:
    """Return whether a file of a cache is there as it was made."""
    try:
        return _digest_of(path).read_bytes() == sha256(path).encode("ascii")
    except OSError:
        return False


@contextlib.contextmanager
def _turn(lock: Path) -> Iterator[None]:
    """Wait for a lock, hold it, and remove its file; a file system without locks lets everybody in."""
    while True:
        handle = os.open(lock, os.O_RDWR | os.O_CREAT)
        with contextlib.suppress(OSError):
            _lock(handle, wait=True)
        try:
            if os.path.samestat(os.fstat(handle), os.stat(lock)):
                break
        except FileNotFoundError:
            pass
        os.close(handle)  # the process before removed the file between opening and locking it
    try:
        yield
    finally:
        with contextlib.suppress(OSError):  # on Windows an open file stays, until the last process is through
            lock.unlink()
        os.close(handle)


def sha256(path: Path) -> str:
    """Return the SHA-256 of a file as hexadecimal digits."""
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


#: failures of the machine: disk, open files
MACHINE = (errno.ENOSPC, errno.EDQUOT, errno.EIO, errno.EMFILE, errno.ENFILE, errno.EROFS)


class DamagedFmuError(GyrobenchError):
    """An FMU that cannot be unzipped."""


#: folders of binaries, of FMI 2.0 and 3.0, by the beginning of the platform's name in Python
BINARIES = {
    "linux": ("linux32", "linux64", "aarch64-linux", "x86-linux", "x86_64-linux"),
    "win": ("win32", "win64", "aarch64-windows", "x86-windows", "x86_64-windows"),
    "darwin": ("darwin64", "aarch64-darwin", "x86_64-darwin"),
}
FOREIGN = [f"binaries/{n}/" for system, names in BINARIES.items() if not sys.platform.startswith(system) for n in names]
NOT_RUN = ("sources/", "documentation/", *FOREIGN)


#: limits of an archive that is unzipped: files, bytes, and how many times its size where it gives more than SMALL bytes
MEMBERS = 10_000
UNZIPPED = 1 << 31
RATIO = 100
SMALL = 1 << 26


class OversizedArchiveError(GyrobenchError):
    """An archive that would fill disk or memory if it were unzipped."""


def check_size(path: Path) -> None:
    """Raise OversizedArchiveError for a zip archive beyond the limits, before anything of it is unzipped.

    What cannot be read as one passes: its reader says why.
    """
    try:
        with zipfile.ZipFile(path) as archive:
            members = archive.infolist()
    except (OSError, ValueError, NotImplementedError, zipfile.BadZipFile):
        return
    size, total = path.stat().st_size, sum(m.file_size for m in members)
    problem = ""
    if len(members) > MEMBERS:
        problem = f"{len(members):,} files in the archive; the limit is {MEMBERS:,}"
    elif total > UNZIPPED:
        problem = f"{total / 1e6:,.0f} MB when unzipped; the limit is {UNZIPPED / 1e6:,.0f} MB"
    elif total > max(SMALL, RATIO * size):
        problem = f"{total / 1e6:,.0f} MB when unzipped, {total / size:,.0f} times its size; the limit is {RATIO} times"
    if problem:
        raise OversizedArchiveError(f"{path}: not unzipped: {problem}")


def check_description(path: Path) -> None:
    """Raise OversizedArchiveError or ValueError for an FMU that would fill disk or memory when it is read."""
    check_size(path)
    with zipfile.ZipFile(path) as archive, archive.open("modelDescription.xml") as file:
        reading.check_xml(file.read(reading.LARGEST_XML + 1), "modelDescription.xml", ValueError)


def unzip_fmu(path: Path, folder: Path) -> None:
    """Unzip what a run needs of an FMU: all but sources, documentation and binaries of other operating systems.

    Raises DamagedFmuError and OversizedArchiveError, and OSError for a failure of the machine.
    """
    from fmpy import extract

    check_size(path)
    try:
        extract(str(path), str(folder), include=lambda name: not name.startswith(NOT_RUN))
    except Exception as error:  # of the zip archive, of names and compressed data in it, or FMPy's own
        if isinstance(error, OSError) and error.errno in MACHINE:
            raise
        raise DamagedFmuError(f"{path}: cannot be unzipped, the file is damaged: {error}") from None


class FolderInUseError(GyrobenchError):
    """Another process writes into the folder."""


class FolderLock:
    """The right to write into a folder, for one process at a time; it ends with the process, however that ends.

    Raises FolderInUseError where another process has it.  The folder is made where it does not exist.  ``abandoned``:
    the process that had it before was killed.
    """

    def __init__(self, folder: Path) -> None:
        self.path = folder / LOCK
        while True:
            folder.mkdir(parents=True, exist_ok=True)
            self.abandoned = self.path.exists()
            self.handle = os.open(self.path, os.O_RDWR | os.O_CREAT)
            try:
                _lock(self.handle)
            except OSError:
                owner = os.read(self.handle, 20).decode("ascii", "replace").strip()
                os.close(self.handle)
                whose = f" (process {owner})" if owner else ""
                raise FolderInUseError(
                    f"{folder}: another run writes here{whose}; wait for its end, or name another folder: --out"
                ) from None
            with contextlib.suppress(FileNotFoundError):
                if os.path.samestat(os.fstat(self.handle), os.stat(self.path)):
                    break
            os.close(self.handle)  # the process before removed the file between opening and locking it
        os.ftruncate(self.handle, 0)
        os.write(self.handle, str(os.getpid()).encode("ascii"))

    def release(self) -> None:
        """Give the folder free."""
        if self.handle >= 0:
            if os.name != "nt":  # there an open file cannot be removed, and the lock is that of the open file
                self.path.unlink(missing_ok=True)
            os.close(self.handle)
            self.handle = -1
            if os.name == "nt":
                with contextlib.suppress(OSError):
                    self.path.unlink(missing_ok=True)

    def __enter__(self) -> FolderLock:
        return self

    def __exit__(self, *_: object) -> None:
        self.release()


def _lock(handle: int, wait: bool = False) -> None:
    """Lock an open file for this process.  Raises OSError where another one has it, or waits for its end."""
    if os.name == "nt":
        import msvcrt

        # beyond the number of the process, which others read
        os.lseek(handle, 1024, os.SEEK_SET)
        how = msvcrt.LK_LOCK if wait else msvcrt.LK_NBLCK  # type: ignore[attr-defined,unused-ignore]
        msvcrt.locking(handle, how, 1)  # type: ignore[attr-defined,unused-ignore]
        os.lseek(handle, 0, os.SEEK_SET)
        return
    import fcntl

    fcntl.flock(handle, fcntl.LOCK_EX | (0 if wait else fcntl.LOCK_NB))


def cores() -> int:
    """Return the number of cores that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def temporary_folder() -> Path:
    """Make a folder for files of this process; what processes left that were killed is removed once."""
    return Path(tempfile.mkdtemp(dir=_temporary_root(os.getpid())))


@functools.cache
def _temporary_root(process: int) -> Path:
    """Folder of all temporary ones of a process, locked while it lives and removed at its end."""
    sweep()
    root = Path(tempfile.mkdtemp(prefix=TEMPORARY))
    lock = FolderLock(root)

    def remove() -> None:
        if os.getpid() == process:  # not that of a child
            lock.release()
            shutil.rmtree(root, ignore_errors=True)

    Finalize(None, remove, exitpriority=0)  # as atexit, and in forks of multiprocessing, which leave atexit out
    return root


def sweep() -> None:
    """Remove the temporary folders of processes that were killed: those with a lock that nobody holds."""
    for old in Path(tempfile.gettempdir()).glob(f"{TEMPORARY}*"):
        if not (old / LOCK).is_file():
            continue
        try:
            lock = FolderLock(old)
        except (OSError, GyrobenchError):
            continue
        shutil.rmtree(old, ignore_errors=True)
        lock.release()
