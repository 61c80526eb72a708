"""The tables of the elementary functions as C: the same doubles that Python uses."""

from __future__ import annotations

import functools
from collections.abc import Iterable

from gyrobench.component import elementary_constants as c


def _rows(head: str, rows: Iterable[tuple[float, ...]]) -> str:
    return (
        f"static const double {head} = {{\n" + ",\n".join(f"    {{{', '.join(map(repr, r))}}}" for r in rows) + "\n};"
    )


@functools.cache
def tables() -> str:
    """Return elementary_tables.h."""
    values = {
        "STEPS": c.STEPS,
        "STEP_1": c.STEP_1,
        "STEP_2": c.STEP_2,
        "STEP_3": c.STEP_3,
        "STEP_HIGH": c.STEP[0],
        "STEP_LOW": c.STEP[1],
        "HALF_PI_HIGH": c.HALF_PI[0],
        "HALF_PI_LOW": c.HALF_PI[1],
        "PI_HIGH": c.WHOLE_PI[0],
        "PI_LOW": c.WHOLE_PI[1],
        "LN2_STEPS": c.LN2_STEPS,
        "LN2_STEP_1": c.LN2_STEP_1,
        "LN2_STEP_2": c.LN2_STEP_2,
        "LN2_1": c.LN2_1,
        "LN2_2": c.LN2_2,
        "ROOT_HALF": c.ROOT_HALF,
        "LOG_FIRST": c.LOG_FIRST,
        "CIRCLE_BITS": c.CIRCLE_BITS,
        "CIRCLE_LIMBS": len(c.LIMBS),
    }
    limbs = [", ".join(f"0x{x:08X}u" for x in c.LIMBS[k : k + 8]) for k in range(0, len(c.LIMBS), 8)]
    return "\n".join(
        [
            "/* Made by gyrobench/component/elementary_constants.py, which says what stands here. */",
            *(f"#define EF_{name} {value!r}" for name, value in values.items()),
            "static const uint32_t circle[] = { /* floor(128 / pi 2^EF_CIRCLE_BITS), the lowest 32 bits first */",
            *(f"    {line}," for line in limbs),
            "};",
            _rows("turn_table[128][4]", c.TURN),
            _rows("power_table[128][2]", c.POWER),
            _rows(f"log_table[{len(c.LOG)}][3]", c.LOG),
            _rows("angle_table[257][2]", c.ANGLE),
            "",
        ]
    )
