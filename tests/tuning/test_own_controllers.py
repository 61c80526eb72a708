"""Loops whose controller is a number of a part: plants against models of their own, what is refused, proofs."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import optimize

from gyrobench.bench import Bench, UsageError
from gyrobench.engine.session import Session
from gyrobench.packaging import load_part
from gyrobench.record.frequency_response import model_response
from gyrobench.system.system import load_system
from gyrobench.tuning.loop_ports import loops_of
from gyrobench.tuning.own_controllers import own_controller, own_values
from gyrobench.tuning.plant import Plant, plants
from gyrobench.tuning.robustness import measured
from gyrobench.tuning.structures import ControllerStructure, rounded
from gyrobench.tuning.tune_loop import tune
from gyrobench.tuning.wishes import parse_wishes


def plant_of(name: str, loop: str) -> tuple[Plant, dict]:
    """Return the plant of a loop and the parameters of its run."""
    system = load_system(name)
    with Session(system, bench=Bench.find().folder, child=True) as session:
        now, _, document = session.prepare()
        parameters = document.parameters
        part_of = lambda slot: load_part(session.names[slot])  # noqa: E731
        found = plants(session.assembly, parameters, part_of, now.step, [{}], loops_of(system)[loop])
    return found[0], parameters


@pytest.mark.long
@pytest.mark.parametrize("network", [2, 4])
def test_the_networks_of_a_table_make_the_loop_of_the_run(network: int) -> None:
    """Networks 2 (leads 5:1, a lag 1:5) and 4 (three leads 6.5:1, undamped gyro), written out: L is the discrete loop
    of the run at the pickoff, with the float's reaction on the table, from far below its crossover to 200 Hz.
    """
    system = load_system("table_servo_loop").with_values({"network": network})
    with Session(system, bench=Bench.find().folder, child=True) as session:
        now, _, document = session.prepare()
        q, own = document.parameters, document.linear.loops["stabilizer"].discrete
        part_of = lambda slot: load_part(session.names[slot])  # noqa: E731
        plant = plants(session.assembly, q, part_of, now.step, [{}], loops_of(system)["stabilizer"])[0]
    w = q["table.crossover"]
    num, den = np.array([1.0]), np.array([1.0])
    for r in [5.0, 5.0] if network == 2 else [6.5] * 3:
        num, den = np.polymul(num, [np.sqrt(r) / w, 1.0]), np.polymul(den, [1.0 / np.sqrt(r) / w, 1.0])
    if network == 2:
        num, den = np.polymul(num, [12.0 / w, 1.0]), np.polymul(den, [60.0 / w, 1.0])
    J, H, J_g, C_g, K_g, lag = (q[f"table.{n}"] for n in ("J", "H_g", "J_g", "C_g", "K_g", "lag"))
    s = 1j * w
    loop = K_g * H * np.polyval(num, s) / np.polyval(den, s) / (s * (J * s * (J_g * s + C_g) + H * H) * (1.0 + lag * s))
    controller = rounded(num[::-1] / abs(loop), den[::-1], {})
    f = np.geomspace(0.5, 200.0, 40)
    L = plant.response(f) * plant.controller_response(controller, f) + plant.past(f)
    assert model_response(own, f)[:, 0, 0] == pytest.approx(L, rel=1.5e-3)
    assert np.abs(plant.with_controller(controller).poles([plant])).max() < 1.0 + 1e-9


def margins_of(plant: Plant, K: float) -> tuple[float, float]:
    """Return phase margin, degrees, and gain margin, dB, that tuning states of a gain."""
    shape = ControllerStructure("gain").of(plant)
    controller = shape.controller(1.0, [], lambda f: 1.0 / K + 0j)
    f = np.geomspace(1e-4, 0.49, 6000) / plant.step
    L = plant.response(f) * plant.controller_response(controller, f)
    wishes = parse_wishes(["phase margin=1deg", "gain margin=1dB", "bandwidth>1Hz"])
    phase, gain, _ = measured(wishes, f, L[None])[0]
    return float(np.degrees(phase)), 20.0 * float(np.log10(gain))


@pytest.mark.long
def test_margins_of_a_power_gyro_are_those_of_its_own_equations() -> None:
    """(J_x s2 + C_x s) a + H s b = M, (J_y s2 + C_y s) b = H s a, written out here; v waits half a step in the mean and
    b a whole one: within 0.2 dB and 1 degree, for a correction three times the default one.
    """
    plant, q = plant_of("stabilizer_power_2dof", "stabilizer")
    H, J_x, J_y, C_x, C_y = (q[f"gyro.{n}"] for n in ("H", "J_x", "J_y", "C_x", "C_y"))
    K_m, K = 300.0, 300.0 / q["gyro.K_sg_y"]

    def L(w: float) -> complex:
        s = 1j * w
        return complex(K_m * H / (s * ((J_x * s + C_x) * (J_y * s + C_y) + H * H)) * np.exp(-1.5e-4 * s))

    crossed = optimize.brentq(lambda w: abs(L(w)) - 1.0, 0.1, 60.0)
    limit = optimize.brentq(lambda w: np.angle(-L(w)), 60.0, 150.0)
    phase, gain = margins_of(plant, K)
    assert phase == pytest.approx(np.degrees(np.angle(-L(crossed))), abs=1.0)
    assert gain == pytest.approx(-20.0 * np.log10(abs(L(limit))), abs=0.2)


def test_the_plant_of_a_compass_is_an_integrator_that_waits() -> None:
    """psi' = rate, held for 0.1 s: z = exp(jw h), P = h/(z - 1)."""
    plant, _ = plant_of("gyro_magnetic_compass", "slaving")
    f = np.geomspace(1e-4, 1.0, 30)
    assert plant.response(f) == pytest.approx(0.1 / (np.exp(2j * np.pi * f * 0.1) - 1.0), rel=1e-9)


def test_a_part_with_one_number_has_the_structure_gain() -> None:
    with pytest.raises(UsageError, match="the part in slot slaving has one number, its gain; leave --structure out"):
        tune(load_system("gyro_magnetic_compass"), ["bandwidth>1mHz"], structure="lead-lag")
    with pytest.raises(UsageError, match=r"slot table has three networks: lag and lead, .*for lag\+lead\+lead"):
        tune(load_system("table_servo_loop"), ["bandwidth>1Hz"], structure="lead-lag")
    q = {"stabilizer_x.k_i": 10.0, "stabilizer_x.k_m": 0.02, "stabilizer_x.ratio": 50.0, "stabilizer_x.v_max": 27.0}
    own = own_controller(q, "stabilizer_x")
    assert own is not None and own_controller(q, "stabilizer_y") is None
    # 27 V on a motor of 0.02 N.m/V behind 1:50: 27 N.m; 10 of it for 1 V at the amplifier
    assert own.limit(own_values(q, "stabilizer_x")) == pytest.approx(27.0)
    assert own.gain(own_values(q, "stabilizer_x")) == pytest.approx(10.0)


@pytest.mark.long
@pytest.mark.parametrize(
    ("name", "loop", "setting"),
    [
        ("stabilizer_power_2dof", "", "stabilizer.k_m"),
        ("stabilizer_power_two_axis", "y", "stabilizer_y.k_m"),
        ("platform_following", "azimuth", "azimuth.K"),
        ("gyro_magnetic_compass", "", "k"),
        ("table_servo_loop", "", "table.stiffness"),
    ],
)
def test_what_is_promised_is_measured(name: str, loop: str, setting: str) -> None:
    """Its own plan records none of the signals of the loop in platform_following, and flies a turn in the compass."""
    system = load_system(name)
    wanted = system.crossovers().get(loop or next(iter(system.loops))) or 1.0
    structure = "pi" if name == "platform_following" else ""
    found = tune(system, ["phase margin=40deg", f"bandwidth>{0.5 * wanted:.3g}Hz"], structure=structure, loop=loop)
    assert found.had and found.proven and setting in found.settings
    assert found.proofs[0].limits == "" and all(w.agrees for w in found.proofs[0].wishes)
