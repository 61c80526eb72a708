"""Apparent place of Polaris: proper motion, precession, nutation, aberration; hour angle from UTC.  [STAND-ALIGNMENT]

    r = P (r_2000 + mu t)      r' = N r, true equator and equinox of date      + v/c      H = GAST - alpha

Precession by the angles of Capitaine 2003, nutation by the 13 largest terms of IAU 1980 (0.02 arcsec), aberration by
the Earth's velocity on its ellipse (0.01 arcsec), Meeus 1998, chapters 12, 21 to 23; catalogue place: HIP 11767.

Not modelled: parallax (0.008 arcsec), light deflection, polar motion (0.3 arcsec in the latitude), Polaris' companion.
"""

from __future__ import annotations

import math
from datetime import UTC, datetime

import numpy as np

from gyrobench import frames
from gyrobench.arrays import Array
from gyrobench.units import ARCSEC, DEG

#: ICRS, J2000.0: right ascension, declination (deg), proper motion (mas/year, that in right ascension times cos delta)
PLACE = (37.95456067, 89.26410897, 44.48, -11.85)
TT_UTC = 69.184  # s, since 2017
#: multiples of l, l', F, D, Omega; coefficients of nutation in longitude and obliquity, 1e-4 arcsec
NUTATION = (
    (0, 0, 0, 0, 1, -171996.0, 92025.0), (0, 0, 2, -2, 2, -13187.0, 5736.0), (0, 0, 2, 0, 2, -2274.0, 977.0),
    (0, 0, 0, 0, 2, 2062.0, -895.0), (0, 1, 0, 0, 0, 1426.0, 54.0), (1, 0, 0, 0, 0, 712.0, -7.0),
    (0, 1, 2, -2, 2, -517.0, 224.0), (0, 0, 2, 0, 1, -386.0, 200.0), (1, 0, 2, 0, 2, -301.0, 129.0),
    (0, -1, 2, -2, 2, 217.0, -95.0), (1, 0, 0, -2, 0, -158.0, -1.0), (0, 0, 2, -2, 1, 129.0, -70.0),
    (-1, 0, 2, 0, 2, 123.0, -53.0),
)  # fmt: skip


def julian(text: str) -> float:
    """Return the Julian date of a UTC instant as ISO text, "2026-11-28T20:00".  Raises ValueError."""
    when = datetime.fromisoformat(text)
    when = when.replace(tzinfo=UTC) if when.tzinfo is None else when.astimezone(UTC)
    return 2451545.0 + (when - datetime(2000, 1, 1, 12, tzinfo=UTC)).total_seconds() / 86400.0


def _nutation(T: float) -> tuple[float, float, float]:
    """Return nutation in longitude and obliquity and the mean obliquity, rad; T: centuries from J2000.0."""
    arguments = np.array([
        134.96298 + 477198.867398 * T, 357.52772 + 35999.050340 * T, 93.27191 + 483202.017538 * T,
        297.85036 + 445267.111480 * T, 125.04452 - 1934.136261 * T,
    ]) * DEG  # fmt: skip
    psi = eps = 0.0
    for *multiples, longitude, obliquity in NUTATION:
        angle = float(np.dot(multiples, arguments))
        psi += longitude * math.sin(angle)
        eps += obliquity * math.cos(angle)
    return psi * 1e-4 * ARCSEC, eps * 1e-4 * ARCSEC, (84381.406 - 46.836769 * T) * ARCSEC


def apparent(jd_utc: float, ut1_utc: float = 0.0) -> tuple[float, float, float]:
    """Return right ascension and declination of date and Greenwich apparent sidereal time, rad; ut1_utc: s."""
    T = (jd_utc + TT_UTC / 86400.0 - 2451545.0) / 36525.0
    ra, de = (x * DEG for x in PLACE[:2])
    along_ra, along_de = (
        np.array([-math.sin(ra), math.cos(ra), 0.0]),
        np.array([-math.sin(de) * math.cos(ra), -math.sin(de) * math.sin(ra), math.cos(de)]),
    )
    r = np.array([math.cos(de) * math.cos(ra), math.cos(de) * math.sin(ra), math.sin(de)])
    r = r + 100.0 * T * 1e-3 * ARCSEC * (PLACE[2] * along_ra + PLACE[3] * along_de)
    zeta = (2.650545 + 2306.083227 * T + 0.2988499 * T**2 + 0.01801828 * T**3) * ARCSEC
    z = (-2.650545 + 2306.077181 * T + 1.0927348 * T**2 + 0.01826837 * T**3) * ARCSEC
    theta = (2004.191903 * T - 0.4294934 * T**2 - 0.04182264 * T**3) * ARCSEC
    psi, eps, mean = _nutation(T)
    # the Earth's velocity over that of light, mean ecliptic of date
    anomaly = (357.52911 + 35999.05029 * T) * DEG
    sun = (280.46646 + 36000.76983 * T + 1.914602 * math.sin(anomaly) + 0.019993 * math.sin(2.0 * anomaly)) * DEG
    perihelion, e, kappa = (102.93735 + 1.71946 * T) * DEG, 0.016708634 - 0.000042037 * T, 20.49552 * ARCSEC
    velocity = kappa * np.array([
        math.sin(sun) - e * math.sin(perihelion), -math.cos(sun) + e * math.cos(perihelion), 0.0
    ])  # fmt: skip
    r = frames.passive(2, -z) @ frames.passive(1, theta) @ frames.passive(2, -zeta) @ (r / np.linalg.norm(r))
    r = r + frames.passive(0, -mean) @ velocity
    r = frames.passive(0, -mean - eps) @ frames.passive(2, -psi) @ frames.passive(0, mean) @ (r / np.linalg.norm(r))
    days = jd_utc + ut1_utc / 86400.0 - 2451545.0
    gmst = 280.46061837 + 360.98564736629 * days + 0.000387933 * T**2
    gast = gmst * DEG + psi * math.cos(mean + eps)
    return math.atan2(r[1], r[0]) % (2.0 * math.pi), math.asin(r[2]), gast % (2.0 * math.pi)


def hour_angle(jd_utc: float, longitude: float, ut1_utc: float = 0.0) -> tuple[float, float]:
    """Return hour angle, to the west, and declination of Polaris, rad; longitude: rad, east positive."""
    ra, de, gast = apparent(jd_utc, ut1_utc)
    return (gast + longitude - ra + math.pi) % (2.0 * math.pi) - math.pi, de


def azimuth(H: Array, declination: float, latitude: float) -> tuple[Array, Array]:
    """Return azimuth, from north to east, and true altitude at hour angles H (n,), rad; diurnal aberration in it.

    tan A = (-cos d sin H + k cos phi)/(sin d cos phi - cos d cos H sin phi)      k = 0.32 arcsec
    """
    c, s = math.cos(latitude), math.sin(latitude)
    east = -math.cos(declination) * np.sin(H) + 0.32 * ARCSEC * c
    north = math.sin(declination) * c - math.cos(declination) * np.cos(H) * s
    up = math.sin(declination) * s + math.cos(declination) * np.cos(H) * c
    return np.arctan2(east, north), np.arctan2(up, np.hypot(east, north))


def refraction(altitude: Array, pressure: float = 101325.0, temperature: float = 283.15) -> Array:
    """Return by how much air raises a star at a true altitude (rad); Pa, K.  Meeus 1998, eq. 16.4."""
    h = np.degrees(altitude)
    bent = 1.02 / 60.0 / np.tan(np.radians(h + 10.3 / (h + 5.11)))
    return np.asarray(np.radians(bent) * pressure / 101000.0 * 283.0 / temperature)
