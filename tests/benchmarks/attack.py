"""How often the 95 % intervals of records that share no code with the bench hold the truth.

    python tests/benchmarks/attack.py [--runs 100] [--first 1] [--only fixed_position]

The records are those of attack_models.py and attack_tables.py, written from the specification; read and reduced as
``gyrobench reduce SYSTEM --data FILE`` does.  README.md here has the figures.
"""

from __future__ import annotations

import sys
import tempfile
import time
from pathlib import Path

import attack_models
import attack_tables
import numpy as np
from asked import asked

import gyrobench as gb

MODELS = attack_models.MODELS | attack_tables.MODELS


def main() -> int:
    given = asked(__doc__, runs=100, first=1, only=("", "systems whose name begins so"))
    everything: list[bool] = []
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "record.csv"
        for system, model in MODELS.items():
            if not system.startswith(given.only):
                continue
            start, held, z, worst = time.process_time(), dict[str, list[bool]](), list[float](), (0.0, "")
            for seed in range(given.first, given.first + given.runs):
                text, truth = model(np.random.default_rng(seed))
                file.write_text(text, encoding="utf-8")
                result = gb.reduce(system, file).result
                found = {c.name: c for c in result.coefficients if not c.no_value}
                if missing := sorted(set(truth) - set(found)):
                    print(f"{system}, {seed}: no {', '.join(missing)}; there are {', '.join(found)}")
                    return 1
                for name, true in truth.items():
                    c = found[name]
                    held.setdefault(name, []).append(c.interval[0] <= true <= c.interval[1])
                    z.append((c.estimate - true) / c.u)
                    worst = max(worst, (abs(z[-1]), f"{name} of seed {seed}"))
            each = {n: float(np.mean(v)) for n, v in held.items()}
            every = [h for v in held.values() for h in v]
            everything += every
            print(
                f"{system}: {np.mean(every):.3f} of {len(every)} ({given.runs} records), single ones "
                f"{min(each.values()):.3f} .. {max(each.values()):.3f}, rms z {np.sqrt(np.mean(np.square(z))):.2f}, "
                f"largest {worst[0]:.1f} u ({worst[1]}); {time.process_time() - start:.0f} s",
                flush=True,
            )
    print(f"all: {np.mean(everything):.3f} of {len(everything)}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
