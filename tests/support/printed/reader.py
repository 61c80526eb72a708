"""A reader who does what a page says, in an empty folder, with gyrobench from its wheel."""

from __future__ import annotations

import os
import re
import resource
import subprocess
import sys
import sysconfig
import time
import venv
from collections.abc import Mapping
from dataclasses import dataclass, field
from importlib.metadata import distribution
from pathlib import Path

from printed import checks, declared
from printed.pages import CELL, ROOT, Step, read

OTHERS = ("fmpy", "pythonfmu")  # packages whose commands the guides print
LIMIT = 3600.0  # s of one command
ON_DISK = re.compile(r"[\w./-]+\.(?:json|html|pdf|fmu|ssp|csv|toml|svg)")  # a line of output that is the path of a file
SCRIPT = "#!{python}\nimport sys\nfrom {module} import {function}\nsys.exit({function}())\n"
CHECKS = (
    "\n\nimport sys\nsys.path.insert(0, {tests!r})\nfrom printed import checks\nchecks.{check}(globals(), {page!r})\n"
)


@dataclass(frozen=True)
class Installed:
    """Gyrobench as it is after the installation of its wheel; dependencies are borrowed, the checkout is not."""

    python: Path
    environment: Mapping[str, str]

    @property
    def bench(self) -> Path:
        """The folder of the standard bench inside."""
        (folder,) = self.python.parents[1].glob("**/gyrobench/_bench")
        return folder

    @property
    def command(self) -> Path:
        return self.python.with_name("gyrobench" + (".exe" if os.name == "nt" else ""))

    def run(self, folder: Path, *words: str) -> subprocess.CompletedProcess[str]:
        """Run a process in a folder."""
        return subprocess.run(
            words, cwd=folder, capture_output=True, text=True, check=False, env=dict(self.environment), timeout=LIMIT,
            stdin=subprocess.DEVNULL,
        )  # fmt: skip


def build_wheel(folder: Path) -> Path:
    """Return the wheel of the checkout, built into a folder."""
    build = [sys.executable, "-m", "hatchling", "build", "--target", "wheel", "--directory", str(folder)]
    done = subprocess.run(build, cwd=ROOT, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    (wheel,) = folder.glob("*.whl")
    return wheel


def install(wheel: Path, folder: Path) -> Installed:
    """Return the wheel installed into a new environment in a folder, with an empty home."""
    import matplotlib

    venv.create(folder / "v", with_pip=False, symlinks=os.name == "posix")
    python = folder / "v" / ("Scripts/python.exe" if os.name == "nt" else "bin/python")
    (folder / "home").mkdir()
    kept = {k: v for k, v in os.environ.items() if k not in ("PYTHONPATH", "VIRTUAL_ENV", "PYTHONDONTWRITEBYTECODE")}
    environment = {
        **kept, "HOME": str(folder / "home"), "MPLCONFIGDIR": matplotlib.get_cachedir(), "SHELL": "/bin/bash",
        "ZIG_GLOBAL_CACHE_DIR": kept.get("ZIG_GLOBAL_CACHE_DIR", str(Path.home() / ".cache" / "zig")),
        "PATH": f"{python.parent}{os.pathsep}{kept.get('PATH', '')}",
    }  # fmt: skip
    where = [str(python), "-c", "import sysconfig; print(sysconfig.get_path('purelib'))"]
    site = Path(subprocess.run(where, capture_output=True, text=True, check=True, env=environment).stdout.strip())
    # a line in a .pth file is a path of modules; the .pth files there (an editable install) are not read again
    (site / "dependencies.pth").write_text(sysconfig.get_path("purelib") + "\n", encoding="utf-8")
    pip = [sys.executable, "-m", "pip", "--disable-pip-version-check", "--python", str(python), "install", "--quiet"]
    subprocess.run([*pip, "--no-deps", "--no-index", "--no-compile", str(wheel)], check=True, env=environment)
    for package in OTHERS:
        for entry in distribution(package).entry_points.select(group="console_scripts", name=package):
            script = python.with_name(package)
            script.write_text(SCRIPT.format(python=python, module=entry.module, function=entry.attr), encoding="utf-8")
            script.chmod(0o755)
    return Installed(python, environment)


@dataclass(frozen=True)
class Done:
    """A step that was done.  processor: s of CPU time."""

    step: Step
    code: int
    out: str
    err: str
    seconds: float
    processor: float


@dataclass
class Reader:
    """Does the steps of a page in their order, from an empty folder."""

    installed: Installed
    page: str
    folder: Path
    runs: list[Path] = field(default_factory=list)  # folders of the runs that the page's commands have made
    done: list[Done] = field(default_factory=list)

    def __post_init__(self) -> None:
        self.here, self.path = self.folder, ROOT / self.page
        self.folder.mkdir()
        self.steps = read(self.page)

    def run(self, *words: str, step: Step | None = None) -> Done:
        """Return what a process does, in the folder where the reader stands."""
        before, t = resource.getrusage(resource.RUSAGE_CHILDREN), time.perf_counter()
        done = self.installed.run(self.here, *words)
        after = resource.getrusage(resource.RUSAGE_CHILDREN)
        processor = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
        step = step or Step(self.page, 0, "preparation", " ".join(words))
        return Done(step, done.returncode, done.stdout, done.stderr, time.perf_counter() - t, processor)

    def gyrobench(self, *words: str) -> None:
        """Run a command that prepares what a printed one needs."""
        done = self.run(str(self.installed.command), *words)
        assert done.code == 0, f"preparation {words}: {done.err}"

    def prepare(self, step: Step) -> None:
        """Make what a step needs and the reader has: files that the page prints, and the declared preparations."""
        for one in self.steps:
            if one.kind == "file" and _names(step.text, one.name) and not (self.here / one.name).exists():
                self.write(one.name, one.text)
        for preparation in declared.PREPARED:
            for name in preparation.missing(self, step):
                preparation.make(self, name, step)

    def write(self, name: str, text: str) -> Path:
        file = self.here / name
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_text(text, encoding="utf-8")
        return file

    def follow(self, step: Step) -> Done | None:
        """Do one step and check what it promises; return what its process did, if it has one."""
        if step.kind == "file":
            self.write(step.name, step.text)
        if step.kind in ("file", "shown"):
            return None
        if step.kind == "command" and step.text.startswith("cd "):
            self.here = self.here / step.text.removeprefix("cd ").strip()
            assert self.here.is_dir(), step.place
            return None
        self.prepare(step)
        if step.kind == "command":
            done = self.run("bash", "-c", step.text, step=step)
            self.check_command(done)
            for check in (f for pattern, f in checks.AFTER.items() if re.search(pattern, step.text)):
                check(self, done)
        else:
            done = self.python(step)
            assert done.code == 0, f"{step.place}: {done.err[-3000:]}"
        assert str(ROOT) not in done.out + done.err, f"{step.place}: the checkout is in use"
        self.done.append(done)
        return done

    def python(self, step: Step) -> Done:
        """Run a block of Python, or the cells of a notebook, in a process, and what is checked of its names there."""
        code = f"{declared.prelude(step)}{step.text}"
        if step.kind == "notebook":
            code = f"CELLS = {step.text.split(CELL)[1:]!r}\n" + Path(__file__).with_name("notebook.py").read_text(
                "utf-8"
            )
        for check in (f for mark, f in checks.NAMES.items() if mark in code):
            code += CHECKS.format(tests=str(Path(__file__).parents[1]), check=check.__name__, page=str(self.path))
        file = self.folder.with_name(f"{self.folder.name}-{step.line}.py")
        file.write_text(code, encoding="utf-8")
        return self.run(str(self.installed.python), str(file), step=step)

    def check_command(self, done: Done) -> None:
        """Check what any command promises: its exit code, no traceback, the files that it names."""
        text, place = done.step.text, done.step.place
        assert done.code == 0, f"{place}: {text}\nexit code {done.code}\n{done.err[-3000:]}"
        assert "Traceback" not in done.err, f"{place}: {done.err}"
        files = [line.strip() for line in done.out.splitlines() if ON_DISK.fullmatch(line.strip())]
        files += re.findall(r"(?:> |--out |--publish |--output-file |-d )([^\s-]\S*)", text.partition("  #")[0])
        for name in files:
            assert (self.here / name).exists(), f"{place}: {text}: {name} is not there"
        if re.match(r"gyrobench (run|reduce) (?!.*(--template|--no-report))", text):
            assert {Path(f).name for f in files} >= {"report.html", "report.pdf"}, f"{place}: {done.out}"
        if match := re.search(r"^(.*)/result\.json$", done.out, re.M):
            self.runs.append(self.here / match[1])


def _names(text: str, name: str) -> bool:
    """Return whether a text names a file."""
    return bool(re.search(rf"(?<![\w./-]){re.escape(name)}(?![\w/-])", text))
