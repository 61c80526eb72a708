"""Description of a system for ``show`` and the report: slots, wires, order, cuts and delays, plan."""

from __future__ import annotations

from typing import Any

from gyrobench.system.wiring import Assembly, parse_wires


def describe(assembly: Assembly) -> dict[str, Any]:
    """A JSON-able description; order, cuts and delays are those of the object that the engines run."""
    system = assembly.system
    slots = {}
    for slot, declared in system.slots.items():
        d = assembly.descriptions[slot]
        slots[slot] = {
            "socket": declared.socket if isinstance(declared.socket, str) else declared.socket.name,
            "part": declared.part,
            "fmu": str(assembly.paths[slot].name),
            "model": d.modelName,
            "version": d.version or "",
            "generator": d.generationTool or "",
            "absent": list(assembly.bindings[slot].absent),
        }
    cut = {c.wire: str(c) for c in assembly.order.cuts}
    laid = {c.wire for c in assembly.connections}
    wires = []
    for a, x, b, y in parse_wires(system.wires):
        wire = f"{a}.{x} -> {b}.{y}"
        gains = sorted({c.gain for c in assembly.connections if c.wire == wire})
        wires.append({"wire": wire, "connected": wire in laid, "cut": wire in cut, "gains": gains})
    return {
        "system": system.name,
        "title": system.title,
        "spec": list(system.spec),
        "step": system.step,
        "slots": slots,
        "on_request": [name for name in system.on_request if name not in system.slots],
        "wires": wires,
        **assembly.order.as_dict(system.step),
        "plan": system.plan().rows(),
        "duration": system.plan().duration(),
        "options": {
            k: {"value": system[k], "unit": o.unit if isinstance(o.unit, str) else o.unit.__name__, "doc": o.doc}
            for k, o in system.options.items()
        },
        "notes": list(assembly.notes),
    }
