"""SSP archives written by hand for the tests."""

from __future__ import annotations

import zipfile
from collections.abc import Mapping
from pathlib import Path

NAMES = " ".join(
    f'xmlns:{n}="http://ssp-standard.org/SSP1/SystemStructure{what}"'
    for n, what in {"ssd": "Description", "ssc": "Common", "ssv": "ParameterValues", "ssm": "ParameterMapping"}.items()
)
LAG = '<ssd:Component name="{}" type="application/x-fmu-sharedlibrary" source="resources/lag.fmu">{}</ssd:Component>'

VALUE_SET = f'<ssv:ParameterSet {NAMES} version="1.0" name="p"><ssv:Parameters>{{}}</ssv:Parameters></ssv:ParameterSet>'
MAPPING = f'<ssm:ParameterMapping {NAMES} version="1.0">{{}}</ssm:ParameterMapping>'


def bound(values: str, mapping: str = "", attributes: str = "") -> str:
    inside = f'<ssv:ParameterSet version="1.0" name="p"><ssv:Parameters>{values}</ssv:Parameters></ssv:ParameterSet>'
    entries = f'<ssd:ParameterMapping><ssm:ParameterMapping version="1.0">{mapping}</ssm:ParameterMapping>'
    return (
        f"<ssd:ParameterBindings><ssd:ParameterBinding {attributes}><ssd:ParameterValues>{inside}"
        f"</ssd:ParameterValues>{entries + '</ssd:ParameterMapping>' if mapping else ''}</ssd:ParameterBinding>"
        "</ssd:ParameterBindings>"
    )


def real(name: str, value: float, unit: str = "") -> str:
    of_unit = f' unit="{unit}"' if unit else ""
    return f'<ssv:Parameter name="{name}"><ssv:Real value="{value}"{of_unit}/></ssv:Parameter>'


def write_archive(
    path: Path,
    files: Mapping[str, Path | str],
    elements: str,
    connections: str = "",
    values: str = "",
    units: str = "",
    end: str = "",
    times: str = 'startTime="0" stopTime="0.5"',
    version: str = "1.0",
) -> Path:
    """Write an archive: elements, connections, what is bound to the system, units, end of the system.

    files: by name in the archive, a file or its text.
    """
    links = f"<ssd:Connections>{connections}</ssd:Connections>" if connections else ""
    text = (
        f'<ssd:SystemStructureDescription {NAMES} version="{version}" name="x"><ssd:System name="x">{values}'
        f"<ssd:Elements>{elements}</ssd:Elements>{links}{end}</ssd:System>{units}"
        f"<ssd:DefaultExperiment {times}/></ssd:SystemStructureDescription>"
    )
    with zipfile.ZipFile(path, "w") as z:
        z.writestr("SystemStructure.ssd", text)
        for name, content in files.items():
            z.writestr(name, content if isinstance(content, str) else content.read_bytes())
    return path
