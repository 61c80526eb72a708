"""First harmonic of the head, from a position test of the same axis.  [TEST-ACCEL4, TABLE-POSITION]

b = alpha + D(alpha)     D = E, the position error: where the axis is, less where it was sent
"""

from __future__ import annotations

from gyrobench.result import Result


def first_harmonic(result: Result) -> dict[str, str]:
    """Return D1c, D1s and their u of a `table_position_test`: E1 cos, E1 sin, and the larger of their u.

    Raises LookupError where polygon and heads did not separate the first order.
    """
    found = {c.name: c for c in result.coefficients}
    missing = [n for n in ("E1 cos", "E1 sin") if n not in found or found[n].no_value]
    if missing:
        why = next((found[n].no_value for n in missing if n in found), "not among its coefficients")
        raise LookupError(f"no value of {' and '.join(missing)}: {why}")
    cosine, sine = found["E1 cos"], found["E1 sin"]
    u = max(cosine.u, sine.u)
    return {"D1c": f"{cosine.estimate!r}{cosine.unit}", "D1s": f"{sine.estimate!r}{sine.unit}",
            "u_D1": f"{u!r}{cosine.unit}"}  # fmt: skip
