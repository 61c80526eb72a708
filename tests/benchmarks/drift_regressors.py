"""How often a column that has nothing to do with a rate is taken out of it, and its slope's interval holds zero.

    python tests/benchmarks/drift_regressors.py [--records 200]

Records of 800 samples of white noise, alone or with a random walk or a Gauss-Markov drift; one or six columns, random
walks or the first cosines of the record, which are the worst there is: nothing else of their frequency is left to
estimate the noise from.
"""

from __future__ import annotations

import importlib
import math

import numpy as np
from asked import asked
from scipy.signal import lfilter

from gyrobench.system.system import load_system

N = 800


def noise(kind: str, rng: np.random.Generator) -> np.ndarray:
    white = rng.normal(size=N)
    if kind == "random walk":
        return white + 0.05 * np.cumsum(rng.normal(size=N))
    if kind == "white":
        return white
    phi = math.exp(-1.0 / float(kind.split()[-1]))
    start = rng.normal()
    x, _ = lfilter([math.sqrt(1.0 - phi * phi)], [1.0, -phi], rng.normal(size=N), zi=[phi * start])
    return white + 0.7 * x


def columns(kind: str, number: int, rng: np.random.Generator) -> dict[str, np.ndarray]:
    if kind == "walks":
        return {f"c{k}": np.cumsum(rng.normal(size=N)) for k in range(number)}
    return {f"c{k}": np.cos(np.pi * (k + 1) * (np.arange(N) + 0.5) / N) for k in range(number)}


def main() -> None:
    records = asked(__doc__, records=200).records
    room = importlib.import_module(".regressors", type(load_system("drift_record")).__module__)
    print(f"{records} records each: share with a column taken out, share of 95 % intervals that hold zero")
    for kind in ("white", "random walk", "Gauss-Markov 60", "Gauss-Markov 300"):
        for number in (1, 6):
            for of in ("walks", "cosines"):
                taken = held = 0
                for seed in range(records):
                    rng = np.random.default_rng(seed)
                    y = noise(kind, rng)
                    found = room.regress(y, columns(of, number, rng), {})
                    taken += any(r.kept for r in found)
                    held += sum(r.full[0] < 0.0 < r.full[1] for r in found)
                print(f"{kind:18} {number} {of:8} {taken / records:6.3f} {held / records / number:6.3f}")


if __name__ == "__main__":
    main()
