"""gyrocompass and ship_motion: against equations in angles by scipy, closed forms by hand, a ship on a sphere."""

import math

import numpy as np
import pytest
from scipy import integrate
from wired import BENCH, Native

from gyrobench.component import ComponentError
from gyrobench.packaging import load_part

Compass = load_part("gyrocompass", BENCH)
Ship = load_part("ship_motion", BENCH)
DEG, ARCMIN, G0, W, R = math.pi / 180.0, math.pi / 10800.0, 9.80665, 7.2921159e-5, 6.371e6
LATITUDE = 40 * DEG
NORTH, UP = W * math.cos(LATITUDE), W * math.sin(LATITUDE)


def stepped(time, step, *, rate=(0.0, NORTH, UP), f=(0.0, 0.0, G0), cut=0.0, **parameters):
    """A compass after so many s under constant inputs."""
    part = Native("gyrocompass", step=step, **parameters)
    part.rate, part.f, part.cut = rate, f, cut
    part.initialize()
    for k in range(round(time / step)):
        part.do_step(k * step, step)
    return part


def in_angles(time, start, rate, f, H, mgl, D=0.0, C=0.0, T=800.0, swing=60.0, zeta=0.2):
    """Azimuth, tilt and swing by scipy; axes e = (cos az, -sin az, 0), v = (-sin az sin el, -cos az sin el, cos el)."""

    def flow(_, y):
        az, el, x, s, sd = y
        e = np.array([math.cos(az), -math.sin(az), 0.0])
        v = np.array([-math.sin(az) * math.sin(el), -math.cos(az) * math.sin(el), math.cos(el)])
        h = np.array([math.sin(az) * math.cos(el), math.cos(az) * math.cos(el), math.sin(el)])
        along = float(h @ f) / G0
        # the weight hangs below the element's u; its torque is about e' = e cos s - v sin s
        about, upright = C * x - mgl * along, -D * along
        east = (about * math.cos(s) + upright * math.sin(s)) / H + float(v @ rate)
        up = (upright * math.cos(s) - about * math.sin(s)) / H - float(e @ rate)
        n = 2.0 * math.pi / swing
        side = (float(e @ f) * math.cos(s) - float(v @ f) * math.sin(s)) / G0
        return [east / math.cos(el), up, (along - x) / T, sd, n * n * side - 2.0 * zeta * n * sd]

    y0 = [start[0], start[1], math.sin(start[1]), 0.0, 0.0]
    return integrate.solve_ivp(flow, (0.0, time), y0, rtol=1e-10, atol=1e-12).y[:, -1]


@pytest.mark.parametrize("damped", [{"D": 0.01}, {"C": 0.2, "T": 700.0}])
def test_precession_is_that_of_the_equations_in_angles(damped):
    """1.4 rad off, tilted, under acceleration both ways and a ship's transport rate."""
    rate, f = np.array([-1.2e-6, 5.7e-5, 4.8e-5]), np.array([0.3, -0.5, 9.7])
    part = stepped(600.0, 1.0, rate=rate, f=f, H=12.0, mgl=0.33, azimuth_start=1.4, tilt_start=-0.1, **damped)
    az, el, x, s, _ = in_angles(600.0, (1.4, -0.1), rate, f, 12.0, 0.33, **damped)
    assert part.get("azimuth") == pytest.approx(az, abs=2e-6) and part.get("tilt") == pytest.approx(el, abs=2e-6)
    assert part.get("swing") == pytest.approx(s, abs=2e-5)
    assert abs(az - 1.4) > 0.1 and abs(s) > 0.02
    if "C" in damped:
        assert part.get("x") == pytest.approx(x, abs=2e-6)


def test_period_and_resting_elevation():
    """H 12, mgl 0.7 at 40 degrees: 58.0 min; mean tilt w sin L/(mgl/H + w cos L) = 2.76 arcmin up in the north."""
    part = Compass(step=4.0, mgl=0.7, azimuth_start=0.02, tilt_start=UP / (0.7 / 12.0 + NORTH))
    part.rate[:] = [0.0, NORTH, UP]
    part.initialize()
    az, el = [], []
    for k in range(2700):
        part.do_step(4.0 * k, 4.0)
        az.append(part.get("azimuth"))
        el.append(part.get("tilt"))
    az = np.array(az)
    down = np.flatnonzero((az[:-1] > 0.0) & (az[1:] <= 0.0))
    crossings = 4.0 * (down + az[down] / (az[down] - az[down + 1]))
    period = 2.0 * math.pi / math.sqrt((0.7 / 12.0 + NORTH) * NORTH)
    assert period / 60.0 == pytest.approx(58.0, abs=0.05)
    assert np.diff(crossings) == pytest.approx(period, rel=2e-3)
    assert 0.5 * (max(el) + min(el)) / ARCMIN == pytest.approx(2.76, abs=0.03)


def test_vertical_torque_leaves_a_latitude_error_and_a_horizontal_one_none():
    """D/mgl tan L = 0.3/0.7 tan 40 = 0.3596 rad less the part of H w_N: 20.6 degrees; a liquid: 0."""
    vertical = stepped(40000.0, 10.0, mgl=0.7, D=0.3, azimuth_start=0.2)
    assert vertical.get("azimuth") / DEG == pytest.approx(20.6, rel=0.03)
    small = stepped(60000.0, 10.0, mgl=0.33, D=0.01, azimuth_start=0.2)
    assert small.get("azimuth") == pytest.approx(0.01 * math.tan(LATITUDE) / (0.33 + 12.0 * NORTH), rel=1e-3)
    south = stepped(60000.0, 10.0, mgl=0.33, D=0.01, rate=(0.0, NORTH, -UP))
    assert south.get("azimuth") == pytest.approx(-small.get("azimuth"), rel=1e-3)
    horizontal = stepped(60000.0, 10.0, mgl=0.33, C=0.2, azimuth_start=0.2)
    assert abs(horizontal.get("azimuth")) < 1e-5


@pytest.mark.parametrize("course", [0.0, 1.1, -2.5])
def test_axis_rests_where_the_horizontal_rate_points(course):
    """tan delta = V cos psi/(R w cos L + V sin psi), west of north on northern courses; the corrector takes it away."""
    V = 15.0
    rate = (-V * math.cos(course) / R, NORTH + V * math.sin(course) / R, UP)
    delta = math.atan2(V * math.cos(course), R * NORTH + V * math.sin(course))
    tilt = UP / (0.33 / 12.0 + NORTH)
    part = stepped(1500.0, 10.0, rate=rate, mgl=0.33, azimuth_start=-delta, tilt_start=tilt)
    assert part.get("azimuth") == pytest.approx(-delta, abs=1e-5)
    for corrected, expected in ((0, course + delta), (1, course)):
        shown = Compass(azimuth_start=-delta, speed_correction=corrected, latitude=LATITUDE)
        shown.heading, shown.speed = course, V
        shown.initialize()
        assert shown.get("psi") == pytest.approx(expected, abs=1e-12)


def test_latitude_corrector():
    """The reading gets back D tan L/(mgl + H w cos L), of the latitude as set."""
    error = 0.01 * math.tan(LATITUDE) / (0.33 + 12.0 * NORTH)
    part = Compass(mgl=0.33, D=0.01, azimuth_start=error, latitude_correction=1, latitude=LATITUDE)
    part.heading = 0.7
    part.initialize()
    assert part.get("psi") == pytest.approx(0.7, abs=1e-9)


@pytest.mark.parametrize("tuned", [1.0, 1.5])
def test_schuler_tuning(tuned):
    """20 m/s north in 200 s: deflection -(mgl/H) 20/g, new rest -20/(R w_N): one and the same at mgl/H = g/(R w_N)."""
    mgl = tuned * 12.0 * G0 / (R * NORTH)
    part = Compass(step=1.0, mgl=mgl, tilt_start=UP / (mgl / 12.0 + NORTH))
    part.initialize()
    for k in range(200):
        part.rate[:], part.f[:] = [-0.1 * (k + 0.5) / R, NORTH, UP], [0.0, 0.1, G0]
        part.do_step(float(k), 1.0)
    rest, omega = -20.0 / (R * NORTH), math.sqrt((mgl / 12.0 + NORTH) * NORTH)
    # what is over the rest grows at (1 - tuned) 0.1/(R w_N) and swings
    over = (1.0 - tuned) * 0.1 / (R * NORTH) * math.sin(200.0 * omega) / omega
    assert part.get("azimuth") == pytest.approx(rest + over, abs=2e-3 * abs(rest))


def test_cut_takes_the_damping_away():
    """From the latitude error on: cut off the axis swings back to the meridian, Omega2 az t2/2 in the first seconds."""
    rest = 0.01 * UP / ((0.33 / 12.0 + NORTH) * 12.0 * NORTH)
    start = {"mgl": 0.33, "D": 0.01, "azimuth_start": rest, "tilt_start": UP / (0.33 / 12.0 + NORTH)}
    kept, cut = stepped(200.0, 2.0, **start), stepped(200.0, 2.0, cut=1.0, **start)
    assert kept.get("azimuth") == pytest.approx(rest, rel=1e-3)
    omega = math.sqrt((0.33 / 12.0 + NORTH) * NORTH)
    assert cut.get("azimuth") == pytest.approx(rest * math.cos(200.0 * omega), rel=1e-3)


def test_random_drift_has_its_density():
    """100 s at 1e-5 rad/s/sqrt(Hz): 1e-4 rad; 60 seeds: 9 %, here 2.5 of these."""
    ends = [
        stepped(100.0, 10.0, rate=(0.0, 0.0, 0.0), mgl=1e-9, white_az=1e-5, seed=s).get("azimuth") for s in range(60)
    ]
    assert float(np.std(ends)) == pytest.approx(1e-4, rel=0.23)


def test_refused():
    with pytest.raises(ComponentError, match="upside down"):
        Compass(mgl=0.3, C=0.3).initialize()
    with pytest.raises(ComponentError, match="stands upright"):
        stepped(40.0, 1.0, mgl=1e-9, drift_el=0.1, rate=(0.0, 0.0, 0.0))
    for name in ("H", "mgl"):
        with pytest.raises(ComponentError):
            Compass(**{name: 0.0}).initialize()


# ------------------------------------------------------------------------------------------------ the ship
def test_rates_and_specific_force_are_those_of_a_point_above_a_turning_sphere():
    """Position of the compass in inertial axes, its second difference less gravitation, in the axes E, N, U.

    Course 0.8 with 1e-3 rad/s of turn, 12 m/s with 0.02 m/s2, sailing, 10 m above the roll axis; g is the plumb's, so
    that gravitation is -g U + w x (w x r) at the ship.
    """
    V0, a, psi0, turn, roll, f_r, L0 = 12.0, 0.02, 0.8, 1e-3, 0.2, 0.1, 0.9
    part = Ship(step=0.05, sailing=1, latitude=L0, start_heading=psi0, start_speed=V0, forward=[a] + [0.0] * 98,
                turn=[turn] + [0.0] * 98, roll=[roll] + [0.0] * 98, roll_frequency=[f_r] + [0.0] * 98,
                onset=1e-3)  # fmt: skip
    part.initialize()
    part.gate = 1.0
    for k in range(200):
        part.do_step(0.05 * k, 0.05)

    def ship(t, y):
        V, psi, L, _ = y
        return [a, turn, V * math.cos(psi) / R, V * math.sin(psi) / R / math.cos(L)]

    way = integrate.solve_ivp(ship, (0.0, 11.0), [V0, psi0, L0, 0.0], rtol=1e-12, atol=1e-14, dense_output=True).sol

    def axes(t):
        _, psi, L, lon = way(t)
        lam = lon + W * t
        E = np.array([-math.sin(lam), math.cos(lam), 0.0])
        N = np.array([-math.sin(L) * math.cos(lam), -math.sin(L) * math.sin(lam), math.cos(L)])
        return E, N, np.cross(E, N), psi

    def place(t, lever=10.0):
        E, N, U, psi = axes(t)
        starboard, r = math.cos(psi) * E - math.sin(psi) * N, roll * math.sin(2.0 * math.pi * f_r * t)
        return R * U + lever * (math.sin(r) * starboard + math.cos(r) * U)

    t, d = 10.0, 0.05
    E, N, U, psi = axes(t)
    earth = np.array([0.0, 0.0, W])
    moved = (place(t + d) - 2.0 * place(t) + place(t - d)) / d**2
    g = G0 * U - np.cross(earth, np.cross(earth, R * U))
    # the lever's turn with the axes is left out by the part: 10 m times 1e-3 rad/s times the roll's rate
    assert [part.get(f"f[{k}]") for k in (1, 2, 3)] == pytest.approx([x @ (moved + g) for x in (E, N, U)], abs=3e-3)
    frames = [np.array(axes(t + s)[:3]) for s in (-1.0, 1.0)]
    spin = (frames[1] - frames[0]) / 2.0 @ np.array([E, N, U]).T  # rows: derivatives of E, N, U in E, N, U
    assert [part.get(f"rate[{k}]") for k in (1, 2, 3)] == pytest.approx([spin[1, 2], spin[2, 0], spin[0, 1]], abs=1e-9)
    assert part.get("heading") == pytest.approx(psi) and part.get("latitude_now") == pytest.approx(way(t)[2], abs=1e-9)


def test_coriolis_force_of_a_steady_course():
    """15 m/s east at 50 degrees: f_N = (2 w sin L + V tan L/R) V, f_U = g - 2 w cos L V - V2/R."""
    part = Ship(latitude=50 * DEG, start_speed=15.0, start_heading=90 * DEG)
    part.initialize()
    over = 15.0 * math.tan(50 * DEG) / R
    assert part.get("f[2]") == pytest.approx((2.0 * W * math.sin(50 * DEG) + over) * 15.0, rel=1e-9)
    assert part.get("f[3]") == pytest.approx(G0 - 2.0 * W * math.cos(50 * DEG) * 15.0 - 225.0 / R, rel=1e-12)
    assert abs(part.get("f[1]")) < 1e-12


def test_rolling_fades_in_and_pitch_moves_the_compass_aft():
    part = Ship(pitch=[0.1] + [0.0] * 98, pitch_frequency=[0.1] + [0.0] * 98, onset=20.0)
    part.initialize()
    part.gate = 1.0
    part.do_step(0.0, 1.0)
    assert abs(part.get("angle[2]")) < 0.1 * 0.01
    for k in range(1, 22):
        part.do_step(float(k), 1.0)
    p = 0.1 * math.sin(2.0 * math.pi * 2.2)
    assert part.get("angle[2]") == pytest.approx(p)
    w2, rate = (0.2 * math.pi) ** 2, 0.1 * 0.2 * math.pi * math.cos(2.0 * math.pi * 2.2)
    assert part.get("f[2]") == pytest.approx(10.0 * (w2 * p * math.cos(p) + rate**2 * math.sin(p)))


def test_ship_stops_at_85_degrees():
    part = Ship(sailing=1, latitude=84.99 * DEG, start_speed=1000.0)
    part.initialize()
    with pytest.raises(ComponentError, match="beyond 85 deg"):
        for k in range(10):
            part.do_step(k * 1.0, 1.0)
