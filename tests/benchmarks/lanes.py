"""Four runs of a system at a time, a lane each (AVX2), against one: time a step, and whether the bits are the same.

Run by hand: ``python tests/benchmarks/lanes.py [--steps N] [system ...]``; a minute each, with g++.  A prototype: the C
of the system's FMU is compiled as C++ with four numbers for each ``double`` (``lanes.hpp``), seeds 7 to 10.  It says
whether lanes are worth building, and is no part of the bench.
"""

from __future__ import annotations

import re
import subprocess
import sys
import tempfile
from pathlib import Path

from gyrobench.exchange.system_fmu import linked_source
from gyrobench.exchange.system_source import source_files
from gyrobench.packaging.compiler import SCALAR
from gyrobench.system.system import load_system

SYSTEMS = ("tumble_single_axis", "servo_polar", "platform_three_axis")
OWN = re.compile(r"static inline double f_(?:fabs|minimum|maximum|clip|sign)\(.*\n")  # lanes.hpp has these
MAIN = r"""
#include <stdlib.h>
#include <time.h>
int main(int argc, char **argv) {
    static PART p;
    const long n = atol(argv[1]);
    unsigned long long hash[4] = {0};
    long k;
    begin(&p, "x");
    initialize(&p, NUMBER(0.0));
    SEEDS
    const clock_t before = clock();
    for (k = 0; k < n && step_parts(&p.n.parts, NUMBER(k * STEP), NUMBER(STEP)) < 0; k++) {}
    printf("%.9g", (clock() - before) / (double)CLOCKS_PER_SEC / n);
    get_outputs(&p.n.parts, value(&p));
    for (int i = 0; i < COUNT; i++)
        for (k = 0; k < N_Y; k++) {
            const double y = value(&p)[Y0 + k]PLACE;
            unsigned long long bits;
            memcpy(&bits, &y, 8);
            hash[i] = hash[i] * 31 + bits;
        }
    for (int i = 0; i < COUNT; i++) printf(" %016llx", hash[i]);
    printf(" %d %ld\n", p.failed, DIVERGED);
    return (void)argc, 0;
}
"""


def program(text: str, lanes: bool, seeds: list[str]) -> str:
    """Return the main function, for four lanes or one number."""
    add = "p.n.parts.{}.n.v.seed.x += v4{{0, 1, 2, 3}};" if lanes else "p.n.parts.{}.n.v.seed += atoi(argv[2]);"
    words = {
        "PART": "L::Part" if lanes else "Part",
        "NUMBER": "L::lane" if lanes else "",
        "COUNT": "4" if lanes else "1",
        "PLACE": ".x[i]" if lanes else "",
        "DIVERGED": "L::diverged" if lanes else "0L",
        "SEEDS": " ".join(f"{add.format(p)} p.n.parts.{p}.kept.keyed = 0;" for p in seeds),
    }
    return re.sub(r"\b(PART|NUMBER|COUNT|DIVERGED|SEEDS)\b|PLACE", lambda m: words[m[0]], text)


def build(system: str, folder: Path) -> None:
    """Write the sources of a system and compile both programs into a folder."""
    linked = linked_source(load_system(system), None, None, None, 7, None, (), "lanes", "none can be made of it")
    files = source_files(linked.source, "", 2)
    parts = re.findall(r"Part_(\w+) (p\d+);", files["model.c"])
    seeds = [place for part, place in parts if "double seed;" in files[f"part_{part}.c"]]
    for name, text in files.items():
        (folder / name).write_text(text, encoding="utf-8")
    head = '#include "functions.h"\n'
    (folder / "one.c").write_text(f'{head}#include "model.c"\n{program(MAIN, False, seeds)}', encoding="utf-8")
    subprocess.run(
        ["gcc", "-O3", *SCALAR, "-std=gnu11", "-ffp-contract=off", "-w", "one.c", "-o", "one", "-lm"],
        cwd=folder, check=True,
    )  # fmt: skip
    functions = files["functions.h"]
    shared = functions[functions.index("/* An index that is known") : functions.index('#include "noise.h"')]
    shared = OWN.sub("", shared.replace('#include "elementary.h"', ""))
    core = files["core.h"].replace("#ifdef __GNUC__", "#if 0")  # pairs of numbers
    core = core.replace("uint64_t key; } drawn", "keys key; } drawn").replace("(uint64_t)p->n.v.seed", "p->n.v.seed")
    (folder / "core.h").write_text(core, encoding="utf-8")
    (folder / "shared.h").write_text(shared, encoding="utf-8")
    (folder / "lanes.hpp").write_text(Path(__file__).with_suffix(".hpp").read_text("utf-8"), encoding="utf-8")
    space = "#undef BY_PROCESSOR\n#define BY_PROCESSOR\nnamespace L {\n"
    space += '#include "lanes.hpp"\n#define double lane\n#include "shared.h"\n#include "model.c"\n#undef double\n}\n'
    text = f"{head}{space}using namespace L;\n{program(MAIN, True, seeds)}"
    (folder / "four.cpp").write_text(text, encoding="utf-8")
    flags = ["-O3", "-std=gnu++17", "-mavx2", "-ffp-contract=off", "-fpermissive", "-w"]
    subprocess.run(["g++", *flags, "four.cpp", "-o", "four"], cwd=folder, check=True)


def ask(folder: Path, *words: str) -> tuple[float, list[str]]:
    done = subprocess.run(words, cwd=folder, capture_output=True, text=True, check=True)
    seconds, *rest = done.stdout.split()
    return float(seconds), rest


def main() -> None:
    words = sys.argv[1:]
    steps = words[words.index("--steps") + 1] if "--steps" in words else "50000"
    names = [w for w in words if not w.startswith("--") and w != steps] or SYSTEMS
    for name in names:
        with tempfile.TemporaryDirectory() as place:
            folder = Path(place)
            build(name, folder)
            ones = [ask(folder, "./one", steps, str(k)) for k in (0, 1, 2, 3)]
            rounds = [(ask(folder, "./one", steps, "0")[0], ask(folder, "./four", steps)) for _ in range(3)]
            one, four = min(r[0] for r in rounds), min(r[1][0] for r in rounds)
            *digests, failed, diverged = rounds[0][1][1]
            same = digests == [o[1][0] for o in ones]
            told = "the same bits" if same and failed == "0" else "OTHER BITS"
            print(f"{name}: {one * 1e9:.0f} ns a step alone, {four / 4 * 1e9:.0f} in four lanes,", end=" ")
            print(f"{4 * one / four:.2f} times as many; {told}, {diverged} conditions diverged", flush=True)


if __name__ == "__main__":
    main()
