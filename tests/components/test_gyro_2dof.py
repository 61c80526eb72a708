"""Wiring rule, steady state of both loops, nutation against closed forms, the static model, and the random drift."""

import math

import numpy as np
import pytest
from free_rotors import G0, NO_DRIFT, QUIET, STILL, Gyro2dof, H, drift, looped, settled, started
from scipy.integrate import solve_ivp
from scipy.spatial.transform import Rotation
from wired import DEG_H

from gyrobench import drift as bench_drift
from gyrobench.component import ComponentError

W = 7.2921159e-5


@pytest.mark.long
def test_ageing_temperature_and_translation_of_each_channel():
    """Hu 1981, eq. 2-39..2-42 in torque sign (omega_d = -omega_M) for both channels, the y channel in its own axes.

    Channel axes (I, O, S) are (x, y, z) and (y, -x, z): components of f and dT along -x change sign.
    """
    rng = np.random.default_rng(4)
    f, dT, v = G0 * rng.uniform(-3.0, 3.0, 3), rng.uniform(-1.0, 1.0, 3), 1e-6 * rng.uniform(-1.0, 1.0, 3)
    slow = {
        f"D{c}_{n}": x for c in "xy" for n, x in zip(("p0", "px", "py", "pz"), rng.uniform(1e-3, 5e-3, 4), strict=True)
    }
    heat = {f"D{c}_T{a}": x for c in "xy" for a, x in zip("xyz", rng.uniform(1e-8, 9e-8, 3), strict=True)}
    move = {f"D{c}_v{a}": x for c in "xy" for a, x in zip("xyz", rng.uniform(0.5, 2.0, 3), strict=True)}
    size = {f"D{c}_{n}": 1e-6 * rng.uniform(1.0, 4.0) for c in "xy" for n in "0xyz"}
    part = started(plain=True, **{**STILL, **size, **slow, **heat, **move}, age=100.0)
    part.f, part.dT, part.v_float = f.tolist(), dT.tolist(), v.tolist()
    for now, age in ((0.0, 100.0), (10.0, 110.0)):
        if now:
            part.do_step(0.0, now)
        else:
            part.outputs()
        for c, axes, sign in (("x", "xyz", (1, 1, 1)), ("y", "yxz", (1, -1, 1))):
            p = {"0": slow[f"D{c}_p0"], **{a: slow[f"D{c}_p{a}"] for a in "xyz"}}
            own = list(zip(sign, axes, strict=True))
            u = [-s * size[f"D{c}_{a}"] * (1.0 + p[a] * age) for s, a in own]  # torque sign
            force = [s * -f["xyz".index(a)] / G0 for s, a in own]
            ends = [s * dT["xyz".index(a)] for s, a in own]
            t_zx, t_yy, t_xz = (heat[f"D{c}_T{a}"] for a in axes)
            torque = -size[f"D{c}_0"] * (1.0 + p["0"] * age)
            torque -= sum(move[f"D{c}_v{a}"] * w for a, w in zip("xyz", v, strict=True))
            torque += (u[0] - t_zx * ends[2]) * force[0]
            torque += (u[1] + t_yy * ends[1]) * force[1]
            torque += (u[2] + t_xz * ends[0]) * force[2]
            assert part.get(f"drift_{c}") == pytest.approx(-torque, rel=1e-12)


# ------------------------------------------------------------------------------------- signs and wiring
def test_signs_of_the_free_rotor():
    """The rotor stays in space: +omega_x leaves the case ahead of it, u_x > 0; +i_y precesses it along +x."""
    part = started(**STILL, omega=[2e-4, 0.0, 0.0])
    for k in range(100):
        part.do_step(k * H, H)
    assert (part.psi_x, part.psi_y) == (pytest.approx(-2e-5, rel=1e-12), 0.0)
    assert (part.u_x, part.u_y) == (pytest.approx(2e-4, rel=1e-12), 0.0)
    part = started(**STILL, i_y=1e-3, i_x=-2e-3)
    for k in range(100):
        part.do_step(k * H, H)
    assert part.psi_x == pytest.approx(1e-4 * 17.180e3 * DEG_H, rel=1e-12)
    assert part.psi_y == pytest.approx(-2e-4 * 17.227e3 * DEG_H, rel=1e-12)


# the first step sees omega_z = 0 (`late`): the exponential step then treats the coupling by Euler's rule
@pytest.mark.parametrize("w_z, late, bound", [(0.5, False, 1e-5), (0.01, True, 1e-5), (0.5, True, 5e-4)])
def test_a_rotor_fixed_in_space_seen_from_a_turning_case(w_z, late, bound):
    """The README's numbers: the rotor axis n' = -omega x n in case axes, psi = (-n_y, n_x), over 1 s."""
    w = np.array([2e-3, -1e-3, w_z])
    part = started(**STILL)
    if late:
        part.do_step(-H, H)
    part.omega = w.tolist()
    for k in range(1000):
        part.do_step(k * H, H)
    n = Rotation.from_rotvec(-w).apply([0.0, 0.0, 1.0])
    tight = solve_ivp(lambda _, n: -np.cross(w, n), (0.0, 1.0), [0.0, 0.0, 1.0], "DOP853", rtol=1e-12, atol=1e-14)
    assert n == pytest.approx(tight.y[:, -1], abs=1e-11)
    error = max(abs(part.psi_x + n[1]), abs(part.psi_y - n[0])) / math.hypot(n[0], n[1])
    print(f"omega_z = {w_z}, late {late}: relative error {error:.2g}")
    assert error < bound


def test_steady_state_is_the_measurement_equation():
    """k_y i_y = omega_x - omega_dx and k_x i_x = omega_y - omega_dy, to the last digits, all terms and a mount."""
    rng = np.random.default_rng(5)
    mount = Rotation.random(random_state=4).as_matrix()
    w, f = rng.normal(size=3) * 1e-4, rng.normal(size=3) * 5.0
    g = settled(
        mount=mount.tolist(), omega=w.tolist(), f=f.tolist(), terms_x=10, terms_y=10, Dx_yy=DEG_H, Dy_xx=-2.0 * DEG_H
    )
    seen_w, seen_f = mount @ w, mount @ f
    assert g.k_y * g.i_y == pytest.approx(seen_w[0] - drift(g, "x", seen_f), rel=1e-12)
    assert g.k_x * g.i_x == pytest.approx(seen_w[1] - drift(g, "y", seen_f), rel=1e-12)
    assert max(abs(g.psi_x), abs(g.psi_y)) < 1e-17


E, N, U = np.eye(3)
POSITIONS = [(E, N), (N, -E), (-E, -N), (-N, E), (U, E), (-E, U), (-U, -E), (E, -U)]  # x, y in (E, N, U)


@pytest.mark.parametrize("position", range(1, 9))
def test_eight_positions_of_the_method(position):
    """The table of TEST-8POS written out; y channel: R_x, u_zx, u_y; x channel: R_y, u_zy, u_x; at 1 g0."""
    R_x, R_y, u_x, u_y, u_zx, u_zy = (v * DEG_H for v in (0.3, -0.5, 1.1, 0.9, -0.6, 0.8))
    latitude = math.radians(45.75)
    wc, ws = W * math.cos(latitude), W * math.sin(latitude)
    x_current = {
        1: -R_x + wc + u_y,
        2: -R_x + u_y,
        3: -R_x - wc + u_y,
        4: -R_x + u_y,
        5: -R_x,
        6: -R_x + ws - u_zx,
        7: -R_x,
        8: -R_x - ws + u_zx,
    }
    y_current = {
        1: R_y + u_x,
        2: R_y + wc + u_x,
        3: R_y + u_x,
        4: R_y - wc + u_x,
        5: R_y + ws - u_zy,
        6: R_y,
        7: R_y - ws + u_zy,
        8: R_y,
    }
    x, y = POSITIONS[position - 1]
    attitude = np.array([x, y, np.cross(x, y)])
    coefficients = {"Dy_0": R_x, "Dy_y": -u_zx, "Dy_z": u_y, "Dx_0": -R_y, "Dx_x": -u_zy, "Dx_z": u_x}
    omega, f = attitude @ [0.0, wc, ws], attitude @ [0.0, 0.0, G0]
    g = settled(2.5, **{**NO_DRIFT, **coefficients}, omega=omega.tolist(), f=f.tolist())
    assert g.k_x * g.i_x == pytest.approx(x_current[position], abs=1e-10 * W)
    assert g.k_y * g.i_y == pytest.approx(y_current[position], abs=1e-10 * W)


def test_torquer_nonlinearity_and_unequal_scale_factors():
    g = settled(**NO_DRIFT, omega=[1e-3, -2e-3, 0.0], k_x=0.08, k_y=0.1, k2_x=0.4, k3_x=30.0, k2_y=-0.3, k3_y=7.0)
    assert 0.1 * g.i_y * (1 - 0.3 * g.i_y + 7.0 * g.i_y * g.i_y) == pytest.approx(1e-3, rel=1e-12)
    assert 0.08 * g.i_x * (1 + 0.4 * g.i_x + 30.0 * g.i_x * g.i_x) == pytest.approx(-2e-3, rel=1e-12)
    assert abs(0.08 * g.i_x / -2e-3 - 1.0) > 2e-3


@pytest.mark.parametrize("h, stable", [(1e-3, True), (5e-3, True), (3e-2, False)])
def test_loop_with_one_more_step_of_delay(h, stable):
    """K_sg k K_p = 100 1/s: with a step of delay psi+ = psi - 0.1 psi(before) ... is stable, at 30 ms it is not."""
    pair = looped(late=True, **NO_DRIFT, omega=[1e-6, -1e-6, 0.0])
    for part in pair.parts.values():
        part.step = 1.0
    for _ in range(round(2.0 / h)):
        pair.step(h)
    g = pair.parts["gyro"]
    assert (max(abs(g.psi_x), abs(g.psi_y)) < 1e-9) is stable


# ---------------------------------------------------------------------------------------- static model
def test_names_and_terms_are_those_of_the_bench():
    for c in "xy":
        declared = {n for n in Gyro2dof.declarations if n.startswith(f"D{c}_")}
        slow = {f"D{c}_{kind}{axis}" for axis in "xyz" for kind in "pTv"} | {f"D{c}_p0"}
        slow |= {f"D{c}_{n}" for n in ("T", "B", "dB", "exposed")}  # of the surroundings
        slow |= {
            f"D{c}_{n}" for n in ("pickoff", "torquer", "voltage", "voltage_z", "phase", "phase_z")
        }  # of the supplies
        assert declared == set(bench_drift.NAMES_2DOF[c]) | slow
        part = started(**QUIET, f=[3.0, -4.0, 5.0])
        some = {n: getattr(part, n) for n in declared - slow}
        assert some.keys() - bench_drift.terms_2dof(c, 9) == {n for n in declared if n in ("Dx_yy", "Dy_xx")}
        wanted = float(bench_drift.drift([-3.0 / G0, 4.0 / G0, -5.0 / G0], some))
        assert getattr(part, f"drift_{c}") == pytest.approx(wanted, rel=1e-13)


def test_every_coefficient_multiplies_its_product():
    rng = np.random.default_rng(8)
    some = {name: rng.normal() * DEG_H for name in NO_DRIFT}
    part = started(plain=True, **QUIET, **some, terms_x=10, terms_y=10)
    for _ in range(10):
        part.f = (rng.normal(size=3) * 10.0).tolist()
        part._dirty = True
        for c in "xy":
            assert part.get(f"drift_{c}") == pytest.approx(drift(part, c, part.f), rel=1e-12)


def test_pickoffs_saturate():
    for omega, wanted in (([0.5, 0.0, 0.0], (0.1, 0.0)), ([0.0, -0.5, 0.0], (0.0, -0.1))):
        part = started(**STILL, omega=omega)
        assert part.saturated == 0.0
        part.do_step(0.0, 0.1)
        assert (part.u_x, part.u_y, part.saturated) == (*wanted, 1.0)


# --------------------------------------------------------------------------------------- random drift
def record(part, n, h, names):
    out = np.empty((n, len(names)))
    for k in range(n):
        part.do_step(k * h, h)
        out[k] = [getattr(part, name) for name in names]
    return out.T


@pytest.mark.parametrize("h", [1e-3, 4e-3])
@pytest.mark.parametrize("port, names", [("white", ("drift_x", "drift_y")), ("pickoff", ("u_x", "u_y"))])
def test_noise_density_per_channel(port, names, h):
    n = 12_000
    sizes = 3e-7, 5e-7
    part = started(**{**STILL, f"{port}_x": sizes[0], f"{port}_y": sizes[1]}, step=1.0)
    x = record(part, n, h, names)
    if port == "pickoff":  # the psi of this case stay 0: u is the noise alone
        assert part.psi_x == part.psi_y == 0.0
    for row, size in zip(x, sizes, strict=True):
        assert row.var() == pytest.approx(size**2 / h, rel=5 * math.sqrt(2 / n))
        means = row.reshape(-1, 40).mean(axis=1)
        assert means.var() == pytest.approx(size**2 / (40 * h), rel=5 * math.sqrt(2 / len(means)))
    assert abs(np.corrcoef(x)[0, 1]) < 5 / math.sqrt(n)


def test_gauss_markov_per_channel():
    tau, n, h = 1.0, 16_000, 0.1
    part = started(**{**STILL, "markov_x": 2e-8, "markov_y": 3e-8, "markov_tau": tau})
    part.step = 1.0
    x = record(part, n, h, ("drift_x", "drift_y"))
    independent = n * h / (2 * tau)
    for row, rms in zip(x, (2e-8, 3e-8), strict=True):
        assert row.var() == pytest.approx(rms**2, rel=5 * math.sqrt(2 / independent))
        for lag in (0.5, 1.0, 2.0):
            k = round(lag / h)
            assert np.mean(row[k:] * row[:-k]) / rms**2 == pytest.approx(
                math.exp(-lag / tau), abs=5 * math.sqrt(2 / independent)
            )
    assert abs(np.corrcoef(x)[0, 1]) < 5 / math.sqrt(independent)


@pytest.mark.long
def test_random_drift_at_the_start():
    first, constant = [], []
    for seed in range(1500):
        part = started(plain=True, **{**STILL, "markov_x": 1e-8, "markov_y": 2e-8, "seed": seed})
        first.append([part.drift_x, part.drift_y])
        part = started(plain=True, **{**STILL, "turn_on_x": 3e-8, "turn_on_y": 5e-8, "seed": seed})
        constant.append([part.drift_x, part.drift_y])
    spread = 5 / math.sqrt(2 * 1500)
    assert np.std(first, axis=0) == pytest.approx([1e-8, 2e-8], rel=spread)
    assert np.std(constant, axis=0) == pytest.approx([3e-8, 5e-8], rel=spread)
    assert abs(np.corrcoef(np.transpose(constant))[0, 1]) < 5 / math.sqrt(1500)
    before = part.drift_x, part.drift_y
    record(part, 50, H, ("drift_x",))
    assert (part.drift_x, part.drift_y) == before


# ------------------------------------------------------------------------------------------- refusals
@pytest.mark.parametrize("channel, second", [("x", "y"), ("y", "x")])
def test_term_sets(channel, second):
    linear, square = f"D{channel}_{second}", f"D{channel}_{second}{second}"
    terms = f"terms_{channel}"
    inside = {name: DEG_H for name in NO_DRIFT if name[1] == channel and name not in (linear, square)}
    started(**{**NO_DRIFT, **inside, terms: 8})
    started(**{**NO_DRIFT, **inside, linear: DEG_H, terms: 9})
    started(**{**NO_DRIFT, **inside, linear: DEG_H, square: DEG_H, terms: 10})
    with pytest.raises(ComponentError, match=f"{linear} must be 0 with {terms} = 8"):
        started(**{**NO_DRIFT, **inside, linear: DEG_H, terms: 8})
    with pytest.raises(ComponentError, match=f"{square} must be 0 with {terms} = 9"):
        started(**{**NO_DRIFT, **inside, square: DEG_H, terms: 9})


@pytest.mark.parametrize(
    "parameters, message",
    [
        ({"terms_x": 5}, "terms_x = 5 is not a static model of a channel: it must be 8, 9 or 10"),
        ({"terms_y": 11}, "terms_y = 11 is not a static model of a channel"),
        ({"J_x": 1e-4}, "J_x = 0.0001 and J_y = 0 kg.m2: give both"),
        ({"C_y": 1e-4}, "C_x and C_y must be 0 without nutation"),
        ({"mount": [[1, 0, 0], [0, 1, 2e-9], [0, 0, 1]]}, "mount is not a rotation matrix"),
        ({"mount": [[1, 0, 0], [0, 0, 1], [0, 1, 0]]}, "mount is left-handed"),
        ({"H": 0.0}, "H = 0 N.m.s must be > 0"),
        ({"J_x": -1.0}, "J_x = -1 kg.m2 must be >= 0"),
        ({"k_x": 0.0}, "k_x = 0 rad/s/A must be > 0"),
        ({"K_sg_y": -1.0}, "K_sg_y = -1 V/rad must be > 0"),
        ({"u_max": 0.0}, "u_max = 0 V must be > 0"),
        ({"markov_tau": 0.0}, "markov_tau = 0 s must be > 0"),
        ({"white_y": -1.0}, r"white_y = -1 rad/s/sqrt\(Hz\) must be >= 0"),
    ],
)
def test_refuses(parameters, message):
    with pytest.raises(ComponentError, match=message):
        started(**parameters)
