"""The profile of a laboratory, ``laboratory.toml``: what its certificates say of it.

name = "Inertial laboratory"
address = ["Example street 1", "12345 Example town"]
accreditation = "D-K-00000-00-00"                        # what follows is optional
logo = "logo.svg"                                        # PNG or SVG, beside the profile, at most 500 kB
country = "DE"                                           # needed for a digital calibration certificate
statements = ["The measurements are traceable to the national standards."]
coefficients = ["D_F", "D_I", "D_S"]                     # shown, in this order; default all
language = "zh"                                          # of the certificate; default en
[[signatories]]
role = "Head of the laboratory"
name = "N. N."
"""

from __future__ import annotations

import base64
import json
import re
from pathlib import Path
from typing import Any

from pydantic import BaseModel, ConfigDict, Field, PrivateAttr, ValidationError, field_validator

from gyrobench import reading
from gyrobench.bench import UsageError
from gyrobench.boundary import faults_of
from gyrobench.files import write_whole
from gyrobench.report.language import ENGLISH, codes

FILE = "laboratory.toml"
LARGEST_LOGO = 500_000
PNG = b"\x89PNG\r\n\x1a\n"


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
    logo: str = ""
    country: str = ""
    statements: list[str] = []
    coefficients: list[str] = []
    language: str = ENGLISH
    signatories: list[Signatory] = list(SIGNATORIES)
    _picture: str = PrivateAttr("")

    @property
    def picture(self) -> str:
        """The logo as a data URI; "" where there is none."""
        return self._picture

    @field_validator("country")
    @classmethod
    def _of_two_letters(cls, code: str) -> str:
        if not re.fullmatch("([A-Z]{2})?", code):
            raise ValueError("two capital letters are expected, such as DE")
        return code

    @field_validator("language")
    @classmethod
    def _there_is(cls, code: str) -> str:
        if code not in codes():
            raise ValueError(f"no such language; there are: {', '.join(codes())}")
        return code


def read_laboratory(file: Path) -> Laboratory:
    """Return the profile of a TOML file.  Raises UsageError naming all that is wrong with it."""
    if not file.is_file():
        raise UsageError(
            f"{file}: no profile of a laboratory; write {FILE} with two lines, "
            'name = "Laboratory" and address = ["Street 1", "12345 Town"]'
        )
    return laboratory_of(reading.toml(reading.read_text(file, UsageError), file, UsageError), file)


def laboratory_of(data: dict[str, Any], file: Path) -> Laboratory:
    """Return the profile that the keys of a file make.  Raises UsageError naming all that is wrong with them."""
    try:
        found = Laboratory.model_validate(data)
        found._picture = _logo(file.parent / found.logo) if found.logo else ""
        return found
    except ValidationError as error:
        problems = faults_of(error, lambda place: Signatory if place[0] == "signatories" and place[1:] else Laboratory)
    raise UsageError("\n".join([f"{file}: not a profile of a laboratory:", *(f"  - {p}" for p in problems)]))


def _logo(file: Path) -> str:
    """Return a logo as a data URI.  Raises UsageError for a file that is no PNG or SVG, or is too large."""
    if not file.is_file():
        raise UsageError(f"{file}: no such logo")
    content = file.read_bytes()
    if len(content) > LARGEST_LOGO:
        raise UsageError(f"{file}: {len(content) // 1000} kB; a logo has at most {LARGEST_LOGO // 1000} kB")
    if content.startswith(PNG):
        kind = "png"
    elif file.suffix.lower() == ".svg":
        reading.xml(content, file, UsageError)
        kind = "svg+xml"
    else:
        raise UsageError(f"{file}: a logo is a PNG or an SVG file")
    return f"data:image/{kind};base64,{base64.b64encode(content).decode()}"


def write_laboratory(profile: Laboratory, file: Path) -> None:
    """Write a profile as TOML; what it leaves at its default is left out."""
    given = profile.model_dump(exclude_defaults=True)
    tables = given.pop("signatories", [])
    text = "".join(f"{k} = {_toml(v)}\n" for k, v in given.items())
    text += "".join("\n[[signatories]]\n" + "".join(f"{k} = {_toml(v)}\n" for k, v in t.items()) for t in tables)
    write_whole(file, text.encode())


def _toml(value: Any) -> str:
    return json.dumps(value, ensure_ascii=False).replace("\x7f", "\\u007f")  # strings and lists are written as in JSON
