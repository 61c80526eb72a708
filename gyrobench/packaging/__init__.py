"""Component -> FMU: description, native target, Python target, build cache, validation."""

from gyrobench.packaging.compiler import CompilerError
from gyrobench.packaging.fmu import build
from gyrobench.packaging.loading import BuildError, load_part
from gyrobench.packaging.source import SubsetError

__all__ = ["BuildError", "CompilerError", "SubsetError", "build", "load_part"]
