"""Import of an SSP 1.0 archive, of the bench or a third party, as a system: FMUs, connections, parameter values.

Read are components (FMI 2.0 co-simulation) of one flat system, connectors by the FMUs' own descriptions, connections
with linear transformations, parameter sets (inline or as SSV files) bound to the system or to a component, and the
stop time.  Not read: nested systems, parameter mappings, signal dictionaries, connections to the outside.  An SSP
names no step size, so the caller does.
"""

from __future__ import annotations

import hashlib
import os
import tempfile
import zipfile
from pathlib import Path
from typing import Any
from xml.etree import ElementTree as ET

from gyrobench.bench import Bench
from gyrobench.exchange.ssp_export import SSC, SSD, SSV
from gyrobench.system.binding import fit
from gyrobench.system.sockets import Socket
from gyrobench.system.system import InvalidConfigurationError, Slot, System

NS = {"ssd": SSD, "ssc": SSC, "ssv": SSV}
ANY = Socket("FMU", "any FMU: its own inputs and outputs", ())


def _unpack(path: Path) -> Path:
    """Return the folder of the unzipped archive in the user's cache, keyed by content."""
    key = hashlib.sha256(path.read_bytes()).hexdigest()[:20]
    folder = Bench.find().cache / f"ssp-{key}"
    if not folder.is_dir():
        folder.parent.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryDirectory(dir=folder.parent) as name:
            unpacked = Path(name) / "open"
            with zipfile.ZipFile(path) as archive:
                for member in archive.namelist():
                    if not (unpacked / member).resolve().is_relative_to(unpacked.resolve()):
                        raise InvalidConfigurationError(path.name, [f"'{member}' leaves the archive"])
                archive.extractall(unpacked)
            if not folder.is_dir():
                os.replace(unpacked, folder)
    return folder


def _parameter_set(element: ET.Element) -> dict[str, Any]:
    parameters: dict[str, Any] = {}
    for p in element.findall("ssv:Parameters/ssv:Parameter", NS):
        value = next(iter(p), None)
        if value is None:
            continue
        kind, text, name = value.tag.rpartition("}")[2], value.get("value", ""), p.get("name", "")
        if kind == "Real":
            parameters[name] = float(text)
        elif kind in ("Integer", "Enumeration"):
            parameters[name] = int(text)
        else:
            parameters[name] = text in ("true", "1") if kind == "Boolean" else text
    return parameters


def _bound_values(element: ET.Element, folder: Path) -> dict[str, Any]:
    """Return the parameter values bound to a system or a component."""
    values: dict[str, Any] = {}
    for binding in element.findall("ssd:ParameterBindings/ssd:ParameterBinding", NS):
        prefix = binding.get("prefix", "")
        sets = binding.findall("ssd:ParameterValues/ssv:ParameterSet", NS)
        source = binding.get("source")
        if source is not None:
            sets = [ET.parse(folder / source).getroot()]
        for s in sets:
            values.update({prefix + n: v for n, v in _parameter_set(s).items()})
    return values


def read_ssp(path: Path, step: float) -> System:
    """Return the archive as a system that can be run, shown and exported again; its channels are all connected outputs.

    step: communication step, s.  Raises InvalidConfigurationError for what is not read, and for a file that is not an
    SSP archive.
    """
    from fmpy import read_model_description

    path = Path(path)
    if not path.is_file():
        raise InvalidConfigurationError(path.name, ["no such file"])
    try:
        folder = _unpack(path)
        root = ET.parse(folder / "SystemStructure.ssd").getroot()
    except (OSError, zipfile.BadZipFile, ET.ParseError) as error:
        raise InvalidConfigurationError(path.name, [f"not an SSP archive: {error}"]) from None
    top = root.find("ssd:System", NS)
    if top is None:
        raise InvalidConfigurationError(path.name, ["it has no system"])
    if top.find("ssd:Elements/ssd:System", NS) is not None:
        raise InvalidConfigurationError(path.name, ["nested systems are not read; flatten it"])
    slots: dict[str, Slot] = {}
    raw: dict[str, Any] = {}
    gains: dict[tuple[str, str], float] = {}
    problems = []
    for component in top.findall("ssd:Elements/ssd:Component", NS):
        name = component.get("name", "")
        fmu = folder / component.get("source", "")
        if "." in name or not fmu.is_file():
            problems.append(f"component '{name}': " + ("a name with a dot" if "." in name else f"no file {fmu.name}"))
            continue
        slots[name] = Slot(ANY, str(fmu))
        raw.update({f"{name}.{k}": v for k, v in _bound_values(component, folder).items()})
        binding = fit(ANY, read_model_description(str(fmu), validate=False), None, name)
        gains |= {(name, b.variable): b.gain for b in (*binding.inputs.values(), *binding.outputs.values())}
    raw.update(_bound_values(top, folder))
    wires, factors, outputs = [], {}, []
    for c in top.findall("ssd:Connections/ssd:Connection", NS):
        a, x, b, y = (c.get(n, "") for n in ("startElement", "startConnector", "endElement", "endConnector"))
        if not a or not b:
            continue  # to the outside
        wire = f"{a}.{x} -> {b}.{y}"
        if (a, x) not in gains or (b, y) not in gains:
            problems.append(f"{wire}: no such output or input")
            continue
        wires.append(wire)
        outputs.append(f"{a}.{x}")
        transformation = c.find("ssc:LinearTransformation", NS)
        if transformation is not None:
            if float(transformation.get("offset", "0")) != 0.0:
                problems.append(f"{wire}: a transformation with an offset is not read")
            factor = float(transformation.get("factor", "1"))
            if c.get("suppressUnitConversion") == "true":
                factor *= gains[b, y] / gains[a, x]
            factors[wire] = factor
        elif c.get("suppressUnitConversion") == "true" and gains[a, x] != gains[b, y]:
            factors[wire] = gains[b, y] / gains[a, x]
    if problems:
        raise InvalidConfigurationError(path.name, problems)
    experiment = root.find("ssd:DefaultExperiment", NS)
    stop = experiment.get("stopTime") if experiment is not None else None
    members = {
        "__doc__": root.get("description", ""),
        "title": root.get("name", path.stem),
        "slots": slots,
        "wires": "\n".join(wires),
        "factors": factors,
        "raw": {k: v for k, v in raw.items() if k.partition(".")[0] in slots},
        "channels": tuple(dict.fromkeys(outputs)),
    }
    system: System = type("Archive", (System,), members)()
    system.name, system.step, system.stop = path.stem, step, float(stop) if stop else 1.0
    return system
