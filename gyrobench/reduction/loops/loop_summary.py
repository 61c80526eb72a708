"""The answer of a loop's report in sentences: margins, isolation and by what it is limited.

    result = found.result(..., summary=[*margins(found), *isolation(found, "isolation", "platform.attitude"),
                                        *told(found.coefficients, "A load turns it by up to {peak}.")])

A sentence names coefficients in braces (gyrobench.reduction.estimation.sentences).
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

from gyrobench.reduction.estimation.sentences import Sentence, plain, told
from gyrobench.reduction.loops.loop_result import LoopFindings
from gyrobench.reduction.loops.open_loop import friction_of
from gyrobench.result import Response

DRIFTS = "At rest the platform drifts by {drift}."
AGREES = 0.05  # relative: contributions that miss the whole by more do not explain it
SHIFTED = 0.05  # relative: the step moves the frequency of a limit by less
SAME = 1.0  # dB, between the isolation at 1 Hz and the worst one


def margins(found: LoopFindings, *loops: str) -> list[str]:
    """Return a sentence for each loop: crossover, phase margin, and how far the gain may change; why it has none."""
    sentences: list[str] = []
    for loop in loops or ("stabilizer",):
        key, head = ("", "Crossover") if loop == "stabilizer" else (f" {loop}", f"{loop.capitalize()} loop: crossover")
        told_of = told(found.coefficients, f"{head} {{f_c{key}}}, phase margin {{PM{key}}}{_gain(found, loop, key)}.")
        reason = next((c.no_value for c in found.coefficients if c.name == f"f_c{key}" and c.no_value), "")
        sentences += told_of or ([f"{head}: no value, {reason}."] if reason else [])
    return sentences


def _gain(found: LoopFindings, loop: str, key: str) -> str:
    """Return by how much the gain may rise and fall: as measured, or where that shows no limit, by the linear model
    (without the communication step, where there is one).
    """
    rows = found.margins.get(loop, {})
    by_model = rows.get("continuous") or rows.get("discrete") or [None] * 6
    measured, texts, modelled = found.estimates, [], False
    for verb, name, at in (("rise", f"{{GM{key}}}", 2), ("fall", f"{{-GRM{key}}}", 4)):
        seen = name.strip("{-}") in measured
        row = rows["measured"] if seen else by_model
        if row[at] is not None:
            modelled = modelled or not seen
            f = row[at + 1]
            f = by_model[at + 1] if f and abs((by_model[at + 1] or 0.0) / f - 1.0) < SHIFTED else f
            where = f" to an oscillation at {plain(f, 3)} Hz" if f else ""
            texts.append(f"{verb} by {name if seen else f'{plain(abs(row[at]), 3)} dB'}{where}")
    source = ", by the linear model" if modelled else ""
    return f"; the gain may {' or '.join(texts)}{source}" if texts else ""


def isolation(found: LoopFindings, name: str, output: str, axis: int = 1, plus: str | None = None) -> list[str]:
    """Return how much smaller a motion of the base is on the platform, at 1 Hz and at worst, and what carries it over.

    name: of the response "ratio", whose uncertainty is that of the noise.  output, plus: its channels, see
    LoopFindings.ratio.
    """
    measured = next((r for r in found.responses if r.name == name and r.kind == "ratio"), None)
    if measured is None or not all(y > 0.0 for y in measured.y):
        return []
    k = min(range(len(measured.x)), key=lambda i: abs(math.log(measured.x[i])))
    worst = max(range(len(measured.x)), key=lambda i: measured.y[i])
    if max(measured.y) < 1e-9:
        return []
    text = f"Base motion at {plain(measured.x[k], 3)} Hz reaches the platform {_attenuated(measured, k)}"
    if 20.0 * math.log10(measured.y[worst] / measured.y[k]) > SAME:
        text += f", at {plain(measured.x[worst], 3)} Hz, the worst of the sweep, {_attenuated(measured, worst)}"
    text += " (95 %, noise only)" if "±" in text else ""
    by = limiting(found, output, measured.x[k], axis, plus, measured.y[k])
    dry = friction_of(found.record.run)
    cause = f"; it is carried over {by}" if by else f"; dry friction ({dry}) is beyond the linear model" if dry else ""
    return [Sentence(f"{text}{cause}.", ())]


def _attenuated(r: Response, k: int) -> str:
    size, relative = -20.0 * math.log10(r.y[k]), (r.u[k] or 0.0) if r.u else 0.0
    how = "smaller" if size >= 0.0 else "larger"
    U = 1.96 * 20.0 / math.log(10.0) * relative
    digits = max(1, 1 - math.floor(math.log10(U))) if U > 0.0 else 1
    return f"{abs(size):.{digits}f} ± {U:.{digits}f} dB {how}" if U > 1e-4 else f"{abs(size):.1f} dB {how}"


def limiting(
    found: LoopFindings, output: str, f: float, axis: int = 1, plus: str | None = None, measured: float | None = None
) -> str:
    """Return what carries a motion of the base over: "by back EMF of the motor (91 %) and viscous friction (9 %)".

    "" where the known ways do not make up the linear model's isolation, or that is not the measured one.
    """
    ways = base_ways(found, output, f, axis, plus, measured)
    share = {name: way / sum(ways.values()) for name, way in ways.items()}
    listed = [f"{n} ({100.0 * s:.0f} %)" for n, s in sorted(share.items(), key=lambda i: -i[1]) if s >= 0.005]
    return f"by {' and '.join([', '.join(listed[:-1]), listed[-1]] if len(listed) > 1 else listed)}" if listed else ""


def base_ways(
    found: LoopFindings, output: str, f: float, axis: int = 1, plus: str | None = None, measured: float | None = None
) -> dict[str, float]:
    """Return by how much of the base's angle each way moves the platform at f; {} as :func:`limiting`."""
    torques = base_torques(found.record.run.parameters, f)
    torque = found.excited("discrete", "torque", axis, output, [f])
    whole = found.excited("discrete", "motion", axis, output, [f], plus)
    if not torques or torque is None or whole is None:
        return {}
    total = sum(torques.values()) * complex(torque[0])
    if abs(total - whole[0]) > AGREES * abs(whole[0]) or (
        measured is not None and abs(abs(whole[0]) / measured - 1.0) > AGREES
    ):
        return {}
    return {name: abs(way * complex(torque[0])) for name, way in torques.items()}


def base_torques(p: Mapping[str, Any], f: float) -> dict[str, complex]:
    """Return the torque on a platform at rest for a unit angle of the base about its axis, N.m/rad, by its ways.

    n ratio, s = 2j pi f:  B s,  n2 k_t k_e s/(R + L s),  n (n - 1) J_motor s2, and of a bearing that sticks with the
    stiffness K = stiction/presliding K + s sqrt(K (J + n2 J_motor)).
    [PLATFORM-1AXIS; a motor driven by a voltage that does not depend on its current]
    """
    names = ("viscous", "k_t", "k_e", "R", "L", "ratio", "J_motor", "J", "friction", "stiction", "presliding")
    if any(f"platform.{n}" not in p or isinstance(p[f"platform.{n}"], Sequence) for n in names):
        C = p.get("gyro.C_x")  # of a power gyro, whose outer gimbal is the platform [STAB-POWER-2DOF]
        return {"the damping of the axis": 2j * math.pi * f * float(C)} if C else {}
    viscous, k_t, k_e, R, L, n, J_motor, J, *dry, presliding = (float(p[f"platform.{name}"]) for name in names)
    s, K = 2j * math.pi * f, max(dry) / presliding
    ways = {
        "viscous friction": viscous * s,
        "the back EMF of the motor": n * n * k_t * k_e * s / (R + L * s),
        "the inertia of the motor": n * (n - 1.0) * J_motor * s * s,
        "the sticking bearing": K + s * math.sqrt(K * (J + n * n * J_motor)),
    }
    return {name: way for name, way in ways.items() if way}
