"""Controllers that sample every few communication steps: loops against scipy, the mean over the beginnings by time."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.signal import cont2discrete

from gyrobench.engine.session import Session
from gyrobench.linear.multirate import multirate_step
from gyrobench.packaging import load_part
from gyrobench.record.frequency_response import model_response
from gyrobench.system.system import load_system

H = 2e-4  # s, of the co-simulation
J, K, VISCOUS, BAND = 0.08, 0.4, 0.01, 2.0 * math.pi * 100.0


def step_of(a: object, b: object) -> tuple[np.ndarray, np.ndarray]:
    """Return the step of x' = a x + b u with a held input."""
    a, b = np.array(a), np.array(b)
    ad, bd, *_ = cont2discrete((a, b, np.eye(len(a)), np.zeros(b.shape)), H)
    return ad, bd


def lifted(n: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return A, B, C over n steps with a held voltage: J w' = k v - c w, then the gyro: it sees w of the step's end."""
    a, b = step_of([[-VISCOUS / J]], [[K / J]])
    g, e = step_of([[0.0, 1.0], [-(BAND**2), -math.sqrt(2.0) * BAND]], [[0.0], [BAND**2]])
    A = np.block([[a, np.zeros((1, 2))], [e @ a, g]])
    B = np.vstack([b, e @ b])
    whole, held = np.eye(3), np.zeros((3, 1))
    for _ in range(n):
        whole, held = A @ whole, A @ held + B
    return whole, held, np.array([0.0, 1.0, 0.0])


@pytest.mark.long
@pytest.mark.parametrize("n", [10, 25])
def test_loop_of_a_controller_that_samples_every_few_steps(n: int) -> None:
    """Tustin's controller times C (z - A)^-1 B, z = e^(j w n h): the loop of the linear model, up to 0.45/Ts."""
    system = load_system("gimbal_stabilization")
    for name, value in {"bending": 0.0, "psd": "none"}.items():
        system.set(name, value)
    sampled = {f"{axis}.{name}": x for axis in ("yaw", "pitch") for name, x in (("Ts", n * H), ("discretize", 2))}
    with Session(system) as session:
        document = session.prepare(sampled, 1)[2]
    loop = document.linear.loops["yaw"].discrete
    assert loop is not None and loop.step == pytest.approx(n * H)
    f = np.geomspace(0.1, 0.45 / (n * H), 60)
    z = np.exp(2j * np.pi * f * n * H)
    A, B, C = lifted(n)
    plant = np.array([(C @ np.linalg.solve(x * np.eye(3) - A, B))[0] for x in z])
    s = 2.0 / (n * H) * (z - 1.0) / (z + 1.0)
    num, den = (np.polynomial.polynomial.polyval(s, document.parameters[f"yaw.{name}"]) for name in ("num", "den"))
    assert model_response(loop, f)[:, 0, 0] == pytest.approx(plant * num / den, rel=1e-5)
    closed = document.linear.closed.discrete
    assert closed is not None and closed.step == H


def part(n: int):
    """Return G = (2 s + 30)/(s + 4) in samples of n steps."""
    found = load_part("stabilizer_lti")(form=1, Ts=n * H, discretize=1)
    for name, row in (("num", (30.0, 2.0)), ("den", (4.0, 1.0))):
        for k, x in enumerate(row, 1):
            found.set(f"{name}[{k}]", x)
    found.initialize()
    return found


def test_mean_over_the_beginnings_by_time() -> None:
    """A sine of 20 Hz, sampled every 5 steps: the part of that frequency in v, from a run of the part itself."""
    n, f, count = 5, 20.0, 2000  # 8 periods, a whole number of samples
    model = multirate_step(part(n), ["u"], ["v"], H)
    assert model is not None and model.every == n and model.tick == n - 1
    base = model.baseband()
    z = np.exp(2j * np.pi * f * H)
    got = (base.c * z @ np.linalg.solve(z * np.eye(len(base.a)) - base.a, base.b) + base.d)[0, 0]
    run, made = part(n), []
    for k in range(2 * count):
        run.u = 1e-3 * math.cos(2.0 * math.pi * f * (k + 1) * H)
        run.do_step(k * H, H)
        made.append(run.v)
    t = H * np.arange(count + 1, 2 * count + 1)
    own = 2e3 * np.mean(np.array(made[count:]) * np.exp(-2j * np.pi * f * t))
    assert got == pytest.approx(own, rel=1e-4)


def test_what_is_no_multirate_part() -> None:
    assert multirate_step(part(1), ["u"], ["v"], H) is None
    average = load_part("estimator_moving_average")(Ts=5 * H)
    average.initialize()
    with pytest.raises(ValueError, match="do not repeat after its period"):
        multirate_step(average, ["z"], ["estimate"], H)
    with pytest.raises(ValueError, match="its period is 500 communication steps: 200 at most"):
        multirate_step(part(500), ["u"], ["v"], H)
