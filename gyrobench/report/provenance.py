"""The run.json that a result carries, typed."""

from __future__ import annotations

from typing import TypeVar

from pydantic import Field, ValidationError

from gyrobench.record.run_document import Document, RunDocument
from gyrobench.result import Result
from gyrobench.result_content import ResultError

D = TypeVar("D", bound=Document)


class Provenance(RunDocument):
    """The run.json of a record, with what its system says of the drawing of it."""

    wires: list[str] = Field(default_factory=list, description="connections, slot.variable -> slot.variable")
    shown: list[str] = Field(default_factory=list, description="channels to draw, an entry for each panel")


def provenance(result: Result, kind: type[D]) -> D:
    """Return the run.json of a result as a document of a kind.  Raises ResultError where it is none."""
    try:
        return kind.model_validate(result.provenance)
    except ValidationError as error:
        first = error.errors()[0]
        where = "/".join(map(str, first["loc"]))
        raise ResultError(f"{result.system}: provenance/{where} is not as in a run.json: {first['msg']}") from None
