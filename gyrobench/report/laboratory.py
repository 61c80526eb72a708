"""The profile of a laboratory, ``laboratory.toml``: what its certificates say of it.

name = "Inertial laboratory"
address = ["Example street 1", "12345 Example town"]
accreditation = "D-K-00000-00-00"                        # what follows is optional
country = "DE"                                           # needed for a digital calibration certificate
statements = ["The measurements are traceable to the national standards."]
coefficients = ["D_F", "D_I", "D_S"]                     # shown, in this order; default all
language = "zh"                                          # of the certificate; default en
[[signatories]]
role = "Head of the laboratory"
name = "N. N."
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from pydantic import BaseModel, ConfigDict, Field, ValidationError, field_validator

from gyrobench import reading
from gyrobench.bench import UsageError
from gyrobench.boundary import faults_of
from gyrobench.files import write_whole
from gyrobench.report.language import ENGLISH, codes

FILE = "laboratory.toml"


class Signatory(BaseModel):
    """A line to sign on."""

    model_config = ConfigDict(extra="forbid", strict=True)

    role: str = Field(min_length=1)
    name: str = ""


SIGNATORIES = (Signatory(role="Tested by"), Signatory(role="Approved by"))


class Laboratory(BaseModel):
    """The keys of a profile; see the module."""

    model_config = ConfigDict(extra="forbid", strict=True)

    name: str = Field(min_length=1)
    address: list[str] = Field(min_length=1)
    accreditation: str = ""
    country: str = Field(default="", pattern="^([A-Z]{2})?$")
    statements: list[str] = []
    coefficients: list[str] = []
    language: str = ENGLISH
    signatories: list[Signatory] = list(SIGNATORIES)

    @field_validator("language")
    @classmethod
    def _there_is(cls, code: str) -> str:
        if code not in codes():
            raise ValueError(f"no such language; there are: {', '.join(codes())}")
        return code


def read_laboratory(file: Path) -> Laboratory:
    """Return the profile of a TOML file.  Raises UsageError naming all that is wrong with it."""
    if not file.is_file():
        raise UsageError(f"{file}: no profile of a laboratory; {FILE} needs two lines, name = and address = [...]")
    data = reading.toml(reading.read_text(file, UsageError), file, UsageError)
    try:
        return Laboratory.model_validate(data)
    except ValidationError as error:
        problems = faults_of(error, lambda place: Signatory if place[0] == "signatories" and place[1:] else Laboratory)
    raise UsageError("\n".join([f"{file}: not a profile of a laboratory:", *(f"  - {p}" for p in problems)]))


def write_laboratory(profile: Laboratory, file: Path) -> None:
    """Write a profile as TOML; what it leaves at its default is left out."""
    given = profile.model_dump(exclude_defaults=True)
    tables = given.pop("signatories", [])
    text = "".join(f"{k} = {_toml(v)}\n" for k, v in given.items())
    text += "".join("\n[[signatories]]\n" + "".join(f"{k} = {_toml(v)}\n" for k, v in t.items()) for t in tables)
    write_whole(file, text.encode())


def _toml(value: Any) -> str:
    return json.dumps(value, ensure_ascii=False).replace("\x7f", "\\u007f")  # strings and lists are written as in JSON
