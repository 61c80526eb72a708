"""Tests and loops from Python: load, set, run, reduce, compare.

    import gyrobench as gb

    test = gb.load("tumble_single_axis", latitude="45.75deg")
    test.set("gyro.D_I", "0.9deg/h/g")
    run = test.run(seed=3)                       # in memory; out="folder" keeps record and result.json
    run.result["D_I"].estimate, run.record.windows["mean"], run.record.frame("windows")
    run.report("folder")                         # record, result.json, report.html, report.pdf
    gb.compare(run, test.run(seed=4))            # shows itself in a notebook, prints as a table
    gb.reduce("tumble_single_axis", "data.csv", latitude="45.75deg", k="17.2deg/h/mA")
    gb.load("tumble_single_axis", parts={"gyro": "vendor.fmu"}, maps={"gyro": "vendor.toml"})
    gb.sweep("tumble_single_axis", {"latitude": "0deg..80deg:9"}, seeds=20)   # a data frame, a row a run
    gb.tune("platform_single_axis", ["phase margin=40deg", "bandwidth>10Hz"], ["platform.J=±30%"])
    gb.identify("loop.csv", at="plant input")["phase margin"].value          # of a laboratory's record of a loop
    gb.campaign("campaign.toml", out="folder")
    gb.site("folder").index                      # the page of a stored campaign

The bench is the nearest folder above the working folder with components/, systems/ and reports/, as for the command.
Every error with a message for the user is a :class:`gyrobench.errors.GyrobenchError`; an exception in the code of a
part or a system passes unchanged before a run, and after it as a PostRunError that holds the record.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from gyrobench.bench import UsageError
from gyrobench.boundary import checked
from gyrobench.errors import GyrobenchError
from gyrobench.library.experiment import Experiment, File, Run, name_parts, open_run
from gyrobench.library.many_runs import campaign, site, sweep
from gyrobench.library.suite_experiment import SuiteExperiment, SuiteRun
from gyrobench.record.record import Record
from gyrobench.result import Result
from gyrobench.system.suite import Suite
from gyrobench.workflow.handover import handed_over
from gyrobench.workflow.inputs import load_test
from gyrobench.workflow.instruments import with_instruments
from gyrobench.workflow.run_comparison import Comparison, compare_results, read_result

if TYPE_CHECKING:
    from gyrobench.design.designed_test import DesignedTest
    from gyrobench.identification.multisine import Multisine
    from gyrobench.identification.written_identification import Identification
    from gyrobench.tuning.written_loop import TunedLoop

__all__ = [
    "Comparison", "Experiment", "GyrobenchError", "Record", "Result", "Run", "SuiteExperiment", "SuiteRun", "campaign",
    "compare", "design", "identify", "load", "load_suite", "multisine", "open_run", "reduce", "site", "sweep", "tune",
]  # fmt: skip


@checked
def load(
    name: File,
    values: Mapping[str, Any] | None = None,
    *,
    parts: Mapping[str, File] | None = None,
    maps: Mapping[str, File] | None = None,
    coupling: str = "sequential",
    instrument: str | Sequence[str] = "",
    from_run: Sequence[File] = (),
    **options: Any,
) -> Experiment:
    """Return a system of the bench, or of an SSP archive, ready to run.

    values, options: as of :meth:`Experiment.set`.  parts: slot -> name of a part, path of an FMU, or file of a
    controller of your own (.c, .py).  maps: slot -> mapping file of a third-party FMU.
    coupling: "sequential", or "parallel": each wire carries the value of the step before.  instrument: data sheet
    (``instruments/NAME.toml``, or a file) of a gyro, of a turntable, or both.
    from_run: folders of runs of other tests whose results give values of this one; values and options go before them.
    Raises errors of type GyrobenchError; UsageError for a suite.
    """
    test = load_test(str(name))
    if isinstance(test, Suite):
        raise UsageError(f"{name} is a suite of tests: gyrobench.load_suite('{name}')")
    if coupling not in ("sequential", "parallel"):
        raise UsageError(f"coupling = '{coupling}': one of sequential, parallel")
    test.coupling = "parallel" if coupling == "parallel" else ""
    name_parts(parts)
    swaps: dict[str, Any] = dict(parts or {})
    title, sheet = with_instruments(instrument, swaps, test) if instrument else ("", {})
    test.instrument = title
    experiment = Experiment(test, swaps, maps or {})
    taken = handed_over(test, [Path(run) for run in from_run]) if from_run else {}
    for key, value in {**sheet, **taken, **(values or {}), **options}.items():
        experiment.set(key, value)
    return experiment


@checked
def load_suite(
    name: str,
    values: Mapping[str, Any] | None = None,
    *,
    parts: Mapping[str, File] | None = None,
    maps: Mapping[str, File] | None = None,
    **options: Any,
) -> SuiteExperiment:
    """Return a suite of the bench, ready to run; arguments as of :func:`load`.  Raises UsageError for a system."""
    test = load_test(name)
    if not isinstance(test, Suite):
        raise UsageError(f"{name} is one test, not a suite: gyrobench.load('{name}')")
    name_parts(parts)
    suite = SuiteExperiment(test, parts or {}, maps or {})
    for key, value in {**(values or {}), **options}.items():
        suite.set(key, value)
    return suite


@checked
def reduce(
    name: str, data: File, *, spec: File | None = None, out: File | None = None, force: bool = False, **values: str
) -> Run:
    """Return the reduction of a laboratory's CSV file; values: options and circumstances, which replace its comments.

    ``gyrobench reduce NAME --template`` prints an empty file.  Raises errors of type GyrobenchError.
    """
    return load(name).reduce(data, spec=spec, out=out, force=force, **values)


@checked
def compare(*runs: Run | SuiteRun | File, names: Iterable[str] = ()) -> Comparison:
    """Return runs, or folders of runs, side by side; the first is the baseline.

    names: of the runs, in their order; default the names of their folders, numbered where two are equal.
    ``print`` shows the estimates, a notebook tables; ``.frame()`` is a data frame, ``.write(folder)`` a report.
    Raises UsageError for fewer than two runs, for names that are too few or equal, and for runs with nothing in common.
    """
    opened = [r if isinstance(r, Run | SuiteRun) else Path(r) for r in runs]
    results = [read_result(r) if isinstance(r, Path) else r.result for r in opened]
    named = list(names)
    if named and len(named) != len(results):
        raise UsageError(f"compare: {len(results)} runs, {len(named)} names")
    if not named:
        named = [r.name for r in opened]
        named = [n if named.count(n) == 1 else f"{n} ({k})" for k, n in enumerate(named, 1)]
    return compare_results(list(zip(named, results, strict=True)))


@checked
def design(
    name: str,
    wants: Mapping[str, str | float],
    *,
    time: float | str | None = None,
    criterion: str = "minimax",
    instruments: int = 1,
    noise: File | None = None,
    count: int = 0,
    seed: int = 1,
    values: Mapping[str, Any] | None = None,
    parts: Mapping[str, File] | None = None,
    maps: Mapping[str, File] | None = None,
    **options: Any,
) -> DesignedTest:
    """Return the plan of a system that reaches ``wants`` (name -> standard uncertainty with its unit) soonest.

    time: s, or a text with its unit: the best plan in this time.  criterion: "minimax", "A" or "D".  instruments: noise
    models of a population, the worst of which counts.  noise: folder of a run whose estimated noise is taken.  count:
    runs in which the prediction is counted.  values, options, parts, maps: as of :func:`load`.  ``print`` shows the
    plan as a command.  Raises errors of type GyrobenchError.
    """
    from gyrobench.design.shortest_test import design_test
    from gyrobench.library.experiment import mapping_files, time_of

    given = {**(values or {}), **options}
    test = load(name, given, parts=parts, maps=maps)
    return design_test(
        test.system, wants, time=time_of("time", time), criterion=criterion, instruments=instruments,
        noise_of=None if noise is None else Path(noise), parts=test.parts, maps=mapping_files(maps or {}), seed=seed,
        count=count, given={k: str(v) for k, v in given.items()},
    )  # fmt: skip


@checked
def tune(
    name: str,
    want: Sequence[str],
    over: Sequence[str] = (),
    structure: str = "",
    *,
    loop: str = "",
    pareto: Sequence[str] = (),
    seed: int = 1,
    values: Mapping[str, Any] | None = None,
    parts: Mapping[str, File] | None = None,
    maps: Mapping[str, File] | None = None,
    **options: Any,
) -> TunedLoop:
    """Return the controller of a stabilizer loop for what is wanted, worst case over a spread, proven in co-simulation.

    want: "phase margin=40deg", "bandwidth>20Hz" ...  over: "platform.J=±30%" ...  structure: factors joined by "+",
    or lqg, hinf; "": lead-lag, or what the part has.  loop: its name, of a system that has several.
    pareto: two measures of the wishes, for their trade.
    values, options, parts, maps: as of :func:`load`.  ``had``: whether all of it can be had, by the linear models;
    ``proven``: and the co-simulation does not contradict; ``reasons``: why not.  ``settings`` and ``part`` are for
    :func:`load`; ``print`` shows all as a text, ``.write(folder)`` writes the page.  Raises errors of type
    GyrobenchError.
    """
    from gyrobench.library.experiment import mapping_files
    from gyrobench.tuning.tune_loop import tune as tune_loop

    given = {**(values or {}), **options}
    test = load(name, given, parts=parts, maps=maps)
    return tune_loop(
        test.system, want, over, structure, parts=test.parts, maps=mapping_files(maps or {}), seed=seed,
        given={k: str(v) for k, v in given.items()}, loop=loop, pareto=pareto,
    )  # fmt: skip


@checked
def identify(
    data: File,
    *,
    at: str = "",
    period: str = "",
    band: str | tuple[float, float] = "",
    columns: File | None = None,
    fit: Sequence[str] = (),
    want: Sequence[str] = (),
    against: File | None = None,
) -> Identification:
    """Return open loop, sensitivities, plant and margins of a laboratory's record of a loop, with intervals.

    at: where the excitation enters, "plant input", "reference" or "plant output"; period: its period ("2s"); default:
    what the file states or shows.  band: "0.5Hz..80Hz", or two frequencies in Hz.  columns: a column map.
    fit: physical parameters of the plant, to find ("J", "mode") or known ("k_t=0.4N.m/A"); ``fit.values``,
    ``fit.interval("J")``, ``fit.toml(name)`` for ``--set @FILE``.
    want: margins that it must have ("phase margin=40deg"); against: a record of it at another amplitude.
    ``responses["L"]`` has frequencies, values and intervals, ``["phase margin"]`` is a margin, ``notes`` say what is
    missing or not linear, ``print`` shows all as a text, ``.write(folder)`` writes the page.  Raises errors of type
    GyrobenchError.
    """
    from gyrobench.identification.identify_loop import identify as identify_loop
    from gyrobench.identification.identify_loop import parse_band

    limits = parse_band(band) if isinstance(band, str) else band
    return identify_loop(
        Path(data), at=at, period=period, band=limits, columns=None if columns is None else Path(columns), fit=fit,
        want=want, against=None if against is None else Path(against),
    )  # fmt: skip


@checked
def multisine(band: str, peak: str, period: str = "4s", rate: str = "1kHz", *, seed: int = 1) -> Multisine:
    """Return an excitation for :func:`identify`: odd lines of a band, some left out to show nonlinearity, small peak.

    band: "0.5Hz..100Hz"; peak: with its unit, "0.2N.m".  ``signal`` is a period, SI, ``write(file, periods)`` writes it
    as CSV.  Raises errors of type GyrobenchError.
    """
    from gyrobench.identification.multisine import parse_multisine

    return parse_multisine(band, peak, period, rate, seed)
