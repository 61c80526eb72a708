"""Lessons: a system with sliders, a curve beside its closed formula, a question and an exercise.

A lesson is ``systems/SYSTEM/lessons/NAME.toml``, data alone:

    number      place in the order of all lessons
    end         time of the page; the plan may be longer
    [values]    options and parameters, as for --set
    [symbols]   letter -> "slot.variable" or option: a slider, a constant of the run or an output
    [sliders]   letter -> [lowest, highest, unit]
    [curve]     unit, simulated (a formula of outputs), theory (formulas of t and of parameters), equation (Typst math),
                tolerance: of the simulated curve to the theory; from: time from which both are shown and compared
    [answer]    value (a formula), set (letter -> quantity, also t), unit, tolerance (relative)
    [en], [zh]  title, question, text, task, hint, solution, curve, sliders (letter -> label)

Not modelled: conditions, several curves of one lesson (several lines of theory are).
"""

from __future__ import annotations

import functools
import json
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from gyrobench import reading, units
from gyrobench.bench import Bench, UsageError, standard_folder, suggest_names
from gyrobench.report.language import ENGLISH, catalogue, check_code, codes
from gyrobench.report.render import equation_svg
from gyrobench.workflow.formula import Formula
from gyrobench.workflow.settings import load_system

ROWS = 2000  # of a page
TEXTS = ("title", "question", "text", "task", "hint", "solution", "curve")
#: what a page says beside the lesson
WORDS = (
    "Run", "Defaults", "simulation", "theory", "time", "Exercise", "Check", "Your answer, with its unit", "All signals",
    "Right.", "The size is right, the sign is not.", "Not yet.", "A number with its unit is expected, such as {v}.",
    "The answer has another unit, such as {v}.", "{v} is not allowed", "End at {n}.", "{n} of {n2}", "{n} s",
    "{n} min", "{n} h", "Parts: {v}.",
)  # fmt: skip


@dataclass(frozen=True)
class Lesson:
    """A lesson.  name: of its file.  system: the system it runs.  data: its content as written."""

    name: str
    system: str
    number: int
    data: Mapping[str, Any]

    def texts(self, language: str = ENGLISH) -> Mapping[str, Any]:
        """Return its texts in a language.  Raises UsageError for one that it does not have."""
        if language not in self.data:
            there = ", ".join(code for code in codes() if code in self.data)
            raise UsageError(f"lesson {self.name}: there is no text in '{language}'; there are: {there}")
        found: Mapping[str, Any] = self.data[language]
        return found

    @property
    def values(self) -> dict[str, str]:
        """Options and parameters of its run, as for --set."""
        return {name: str(value) for name, value in self.data["values"].items()}

    @property
    def symbols(self) -> Mapping[str, str]:
        """Letter -> what it stands for in the system."""
        found: Mapping[str, str] = self.data["symbols"]
        return found

    @property
    def end(self) -> float:
        """Time of the page, s."""
        return units.parse_quantity(self.data["end"], "s")

    @property
    def begin(self) -> float:
        """Time from which the curves are shown and compared, s."""
        return units.parse_quantity(self.data["curve"].get("from", "0s"), "s")

    @property
    def simulated(self) -> Formula:
        """The simulated curve."""
        return Formula(self.data["curve"]["simulated"])

    @property
    def theory(self) -> list[Formula]:
        """The lines of the theory."""
        return [Formula(text) for text in self.data["curve"]["theory"]]

    def answer_values(self) -> dict[str, float]:
        """Return letter -> SI value that the exercise sets, t for a time."""
        return {k: units.parse_quantity(str(v), units_of(str(v))) for k, v in self.data["answer"]["set"].items()}

    def answer(self, given: Mapping[str, float]) -> float:
        """Return the right answer, SI.  given: letter -> value of the parameters as they are without the exercise."""
        return float(Formula(self.data["answer"]["value"]).value({**given, **self.answer_values()}))


def units_of(text: str) -> str:
    """Return the SI unit of a quantity that is written with its unit."""
    name = text.lstrip("+-0123456789.e").strip() or "1"
    return units.unit(name).dimension


def lessons(bench: Bench | None = None) -> list[Lesson]:
    """Return the lessons of a bench and of the standard one, in their order.  Raises UsageError for a wrong file."""
    roots = [standard_folder(), *([bench.folder] if bench else [])]
    found = {f.stem: f for root in roots for f in sorted((root / "systems").glob("*/lessons/*.toml"))}
    return sorted((_read(file) for file in found.values()), key=lambda lesson: lesson.number)


def lesson(name: str, bench: Bench | None = None) -> Lesson:
    """Return a lesson.  Raises UsageError."""
    every = {item.name: item for item in lessons(bench)}
    if name not in every:
        raise UsageError(f"no lesson '{reading.shorten(reading.visible(name))}'; {suggest_names(name, every)}")
    return every[name]


@functools.lru_cache(maxsize=64)
def _read(file: Path) -> Lesson:
    data = reading.toml(reading.read_text(file, UsageError), file, UsageError)
    try:
        made = Lesson(file.stem, file.parent.parent.name, int(data["number"]), data)
        symbols = set(made.symbols) | {"t"}
        for formula in (made.simulated, *made.theory):
            if lost := set(formula.names) - symbols:
                raise UsageError(
                    f"{file}: '{formula.text}' has {', '.join(sorted(lost))}, which [symbols] does not say"
                )
        for code in {ENGLISH, *(k for k in ("zh",) if k in data)}:
            for name in TEXTS:
                made.texts(code)[name]
        return made
    except KeyError as error:
        raise UsageError(f"{file}: {error} is missing") from None


def words_in(language: str) -> dict[str, str]:
    """Return the words of a page in a language."""
    if check_code(language) == ENGLISH:
        return {word: word for word in WORDS}
    texts = catalogue(language).texts
    return {word: texts.get(word, word) for word in WORDS}


def page_content(item: Lesson, language: str = ENGLISH) -> dict[str, Any]:
    """Return what a page needs to know of a lesson: texts, sliders, formulas as script, the exercise."""
    texts, curve, answer = item.texts(language), item.data["curve"], item.data["answer"]
    outputs = set(item.simulated.names) - {"t"}
    unit = answer["unit"]
    factor = units.factor(curve["unit"]) if curve["unit"] != "1" else 1.0
    return {
        "name": item.name, "number": item.number, "language": catalogue(language).html if language != ENGLISH else "en",
        "words": words_in(language), "begin": item.begin, "end": item.end, "rows": ROWS,
        **{name: texts[name] for name in TEXTS},
        "symbols": dict(item.symbols), "outputs": sorted(outputs),
        "sliders": {
            item.symbols[letter]: {
                "label": texts["sliders"][letter], "low": low, "high": high, "unit": shown, "letter": letter,
                "shown": units.display(shown), "factor": units.factor(shown) if shown != "1" else 1.0,
            }
            for letter, (low, high, shown) in item.data["sliders"].items()
        },
        "unit": curve["unit"], "shown": units.display(curve["unit"]),
        "factor": factor,
        "least": factor * units.parse_quantity(curve["tolerance"], curve["unit"]),  # margin of the axis
        "simulated": item.simulated.script(_place), "theory": [f.script(_place) for f in item.theory],
        "equation": equation_svg(curve["equation"], f"lesson-{item.name}"),
        "answer": {
            "script": Formula(answer["value"]).script(_place), "set": item.answer_values(), "unit": unit,
            "tolerance": answer["tolerance"],
            "units": {name: units.factor(name) for name in (unit, *units.fitting(unit))},
        },
    }  # fmt: skip


def _place(name: str) -> str:
    return f"v[{json.dumps(name)}]"


def write_lesson(item: Lesson, path: Path, language: str = ENGLISH, bench: Bench | None = None) -> None:
    """Write the page of a lesson, one file that needs neither server nor network.

    Raises what :func:`~gyrobench.exchange.html_page.export_page` raises, CompilerError without ziglang.
    """
    from gyrobench.exchange.html_page import export_page

    system = load_system(item.system, item.values)
    export_page(
        system, path, bench=bench.folder if bench else None, expose=exposed(item), lesson=page_content(item, language)
    )


def exposed(item: Lesson) -> list[str]:
    """Return the parameters and outputs that a page of the lesson needs beside the channels of the system."""
    system = load_system(item.system, item.values)
    channels = set(system.channels)
    return [name for name in item.symbols.values() if name not in channels and name.partition("[")[0] not in channels]


def starts(item: Lesson) -> dict[str, float]:
    """Return letter -> value, SI, of the parameters among its symbols as the page has them at first."""
    from gyrobench.exchange.system_fmu import linked_source

    system = load_system(item.system, item.values)
    made = linked_source(system, None, None, None, 1, None, exposed(item), "lesson", "no page can be made of it")
    given = {e.scalar.name: e.scalar.start for e in made.source.section("parameter")}
    return {letter: float(given[name]) for letter, name in item.symbols.items() if name in given}
