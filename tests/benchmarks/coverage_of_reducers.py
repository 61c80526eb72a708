"""How often the 95 % intervals of each test's reducer hold the truth, made quickly: noise is added to what is read.

    python tests/benchmarks/coverage_of_reducers.py [CASE ...]

Three runs without noise for each case; the noise of the population is drawn with its exact covariance
(tests/systems/test_coverage.py, which makes a quarter of the runs).  The runs are enough to find out intervals for 90 %
or 99 %: counting.check.  coverage.py counts on co-simulations with noise.
"""

from __future__ import annotations

import sys
import time
from pathlib import Path

TESTS = Path(__file__).parents[1]
sys.path[:0] = [str(TESTS / room) for room in ("support", "systems")]

import counting  # noqa: E402
from test_coverage import READ, ratios  # noqa: E402


def main() -> int:
    wrong = []
    for name in sys.argv[1:] or READ:
        began, ratio = time.process_time(), ratios(name, READ[name][1])
        low, high = counting.bounds(ratio)
        try:
            counting.check(ratio)
        except AssertionError as error:
            wrong.append(f"{name}: {error}")
        print(f"{name:<32}{len(ratio):>5} runs   {low:.3f} .. {high:.3f}   {time.process_time() - began:6.1f} s")
    print("\n".join(wrong) or "all of 0.95, not of 0.90 nor 0.99")
    return bool(wrong)


if __name__ == "__main__":
    sys.exit(main())
