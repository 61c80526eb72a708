"""Design of an aerostatic bearing: balance of mass, load, stiffness, gap."""

import math

import numpy as np
import pytest
from scipy.integrate import quad

from gyrobench.design.aerostatic import AerostaticBearing, BearingError, flow_function

KGF = 9.80665
ARCSEC = math.pi / 648000.0


def test_orifice_and_gap_pass_the_same_mass():
    """n Phi A psi p_0 sqrt(rho_a / p_a) in, pi R h3 rho_a (p_d2 - p_a2) / (12 mu l p_a) out (isothermal slot flow)."""
    b = AerostaticBearing()
    for gap in (1e-5, 2e-5, 4e-5):
        ratio = b.pressure_ratio(gap)
        area = math.pi * (0.5 * b.orifice) ** 2
        into = b.orifices * b.discharge * area * flow_function(ratio) * b.supply * math.sqrt(b.density / b.ambient)
        out = math.pi * 0.5 * b.diameter * gap**3 * b.density * ((ratio * b.supply) ** 2 - b.ambient**2)
        assert into == pytest.approx(out / (12.0 * b.viscosity * b.land * b.ambient), rel=1e-9)


def test_load_is_the_pressure_under_the_shaft():
    """p along the land falls with p2 linear: its integral by quadrature, orifice by orifice."""
    b, eps, total = AerostaticBearing(orifices=8), 0.3, 0.0
    for a in 2.0 * math.pi * np.arange(8) / 8:
        p_d = b.supply * b.pressure_ratio(b.gap * (1.0 - eps * math.cos(a)))
        ends = 2.0 * quad(lambda x, p=p_d: math.sqrt(p**2 - (p**2 - b.ambient**2) * x / b.land), 0.0, b.land)[0]
        total += (p_d * (b.length - 2.0 * b.land) + ends) * math.pi * b.diameter / 8 * math.cos(a)
    assert b.load(eps) == pytest.approx(total, rel=1e-9) and b.load(0.0) == pytest.approx(0.0, abs=1e-8)


def test_stiffness_figures():
    """24 holes of 0.2 mm a row, 6 bar, 20 um: 152 kgf/um, 2.87 kgf.m/arcsec; and tilted, two rows at L/4 (ET23)."""
    b = AerostaticBearing()
    assert b.stiffness() / KGF * 1e-6 == pytest.approx(152.0, rel=5e-3)
    assert b.tilt_stiffness() / KGF * ARCSEC == pytest.approx(2.87, rel=5e-3)
    phi, arm = 1e-7, 0.25 * b.length
    assert 2.0 * arm * 0.5 * b.load(phi * arm / b.gap) / phi == pytest.approx(b.tilt_stiffness(), rel=1e-3)
    assert 1.0 < b.tilt_stiffness() / KGF * ARCSEC < 7.0  # not 7 kgf.m/deg = 0.002 kgf.m/arcsec


def test_gap_for_a_stiffness():
    b = AerostaticBearing().with_stiffness(1e9)
    assert b.stiffness() == pytest.approx(1e9, rel=1e-6) and 2e-5 < b.gap < 1e-4
    assert AerostaticBearing(gap=1.1 * b.gap).stiffness() < 1e9  # beyond the maximum: the wider of two
    with pytest.raises(BearingError, match="stiffness = 1e"):
        AerostaticBearing().with_stiffness(1e11)


@pytest.mark.parametrize(
    ("values", "text"),
    [
        ({"supply": 1e5}, "must be above the ambient"),
        ({"gap": 0.0}, "gap = 0"),
        ({"gap": math.nan}, "gap = nan"),
        ({"land": 0.125}, "two of them must fit"),
        ({"orifices": 2}, "at least 3"),
    ],
)
def test_what_is_refused(values, text):
    with pytest.raises(BearingError, match=text):
        AerostaticBearing(**values)


def test_eccentricity_and_wide_gap():
    for eps in (1.0, -0.1):
        with pytest.raises(BearingError, match="eccentricity"):
            AerostaticBearing().load(eps)
    assert not AerostaticBearing().warnings()
    assert "200 um" in AerostaticBearing(gap=2e-4).warnings()[0]
