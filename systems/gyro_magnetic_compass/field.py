"""Magnetic field of a place on a day by the World Magnetic Model; its coefficients come with the package pygeomag.

The model holds the field of the core, to degree 12, and its change over five years.  u is the one of the model's
authors, one sigma, of a place on the ground without local anomalies: of the declination hypot(0.26 deg, 5417 deg/H[nT])
from 2025 on.  Not in it: crust beyond degree 12, magnetic storms, iron nearby.
"""

from __future__ import annotations

import datetime
import math
from dataclasses import dataclass
from functools import lru_cache

from gyrobench.errors import GyrobenchError

DEG = math.pi / 180.0
FIRST, LAST = 2015, 2029  # years with coefficients and with uncertainties


class FieldError(GyrobenchError, ValueError):
    """There is no field of this place and day; the text says why."""


@dataclass(frozen=True)
class Field:
    """Field at a place: rad, declination clockwise, inclination down, horizontal in T; their standard uncertainties."""

    model: str
    declination: float
    inclination: float
    horizontal: float
    u_declination: float
    u_inclination: float
    u_horizontal: float


@lru_cache(maxsize=16)
def field_at(date: str, latitude: float, longitude: float, height: float) -> Field:
    """Return the field on a day (as 2026-07-02) at a geodetic latitude and longitude (rad) and height (m).

    Raises FieldError without the package, and for a day that is not one or without coefficients.
    """
    try:
        day = datetime.date.fromisoformat(date)
    except ValueError:
        raise FieldError(f"date = {date}: is not a day; write it as 2026-07-02") from None
    if not FIRST <= day.year <= LAST:
        raise FieldError(f"date = {date}: the World Magnetic Model is there for {FIRST}-01-01 to {LAST}-12-31")
    try:
        from pygeomag import GeoMag
    except ImportError:
        raise FieldError(
            f"date = {date}: the field of a day needs a further package: pip install 'gyrobench[magnetic]'; or give "
            "declination"
        ) from None
    model = GeoMag(base_year=day.year)
    first = datetime.date(day.year, 1, 1)
    year = day.year + (day - first).days / (datetime.date(day.year + 1, 1, 1) - first).days
    here = model.calculate(glat=latitude / DEG, glon=longitude / DEG, alt=height / 1000.0, time=year)
    u = here.calculate_uncertainty()
    return Field(model.model, here.d * DEG, here.i * DEG, here.h * 1e-9, u.d * DEG, u.i * DEG, u.h * 1e-9)
