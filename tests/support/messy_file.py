"""Readings as a laboratory writes them: cp1252, a header of nine lines, decimal commas, dates, an empty cell."""

from __future__ import annotations

import numpy as np

from gyrobench.arrays import Array

HEADER = """Prüflabor für Kreiselgeräte;;;;
Auftrag;4711;;;
Prüfling;Kreisel Nr. 17;;;
Prüfer;Müller;;;
Datum;12.03.2026;;;
Raumtemperatur;21,3 °C;;;
Lage;Eingangsachse Ost;;;
Bemerkung;Kühlung war aus;;;
;;;;
Datum;Uhrzeit;Strom / mA;Temperatur (°C);Bemerkung
"""


def messy(count: int = 48) -> tuple[bytes, Array]:
    """Readings of half an hour over midnight, one of them missing; the bytes, and the currents in mA."""
    rng = np.random.default_rng(5)
    mean = np.round(0.05 + 0.001 * rng.normal(size=count), 6)
    rows = []
    for k, x in enumerate(mean.tolist()):
        second = 23 * 3600 + 30 * 60 * k
        day, clock = 12 + second // 86400, second % 86400
        text = "" if k == 7 else f"{x:.6f}".replace(".", ",")
        when = f"{day}.03.2026;{clock // 3600:02d}:{clock // 60 % 60:02d}:00"
        rows.append(f"{when};{text};21,{k % 10};{'Tür auf' if k == 3 else ''}")
    return (HEADER + "\n".join(rows) + "\n").encode("cp1252"), mean
