"""Designs of tests: rows and times are those of reduction and run, the prediction is what runs count, refusals."""

from __future__ import annotations

import importlib
import shlex
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import gyrobench as gb
from gyrobench.bench import UsageError
from gyrobench.design import choice_search, plan_search, shortest_test
from gyrobench.design.approximate_design import approximate_design, evaluate
from gyrobench.design.designed_test import DesignedTest
from gyrobench.design.option_protocol import Choice, OptionProtocol
from gyrobench.design.plan_runs import DesignError, Stated, Trial, Workbench, last_time
from gyrobench.design.plan_search import Search, Want, finish, rounded
from gyrobench.design.predicted_uncertainty import predict
from gyrobench.design.shortest_test import design_test, protocol_of
from gyrobench.design.suite_design import cheapest_cover, design_suite
from gyrobench.design.visit_protocol import Channel, DataNoise, VisitProtocol
from gyrobench.engine.session import Session
from gyrobench.reduction.estimation.fit_result import observed_fits
from gyrobench.system.suite import Suite, load_test
from gyrobench.system.system import load_system
from gyrobench.system.values import InvalidValueError
from gyrobench.system.visits import parse_visits

Command = Callable[..., tuple[int, str, str]]

#: short plans that hold every kind of candidate
PLANS = {
    "accelerometer_multipoint": {"dwell": "3s", "settle": "0.5s"},
    "tumble_two_axis": {"visits": "; ".join(f"{50 * k}deg {40 * k}deg" for k in range(10)), "dwell": "10s"},
    "eight_position": {"cycles": 2, "dwell": "20s", "readings": 2},
}  # fmt: skip


@pytest.mark.parametrize("name", PLANS)
@pytest.mark.long
def test_rows_and_times_are_those_of_reduction_and_run(name: str) -> None:
    """What the search works with must be the design matrix that the reduction makes of a record."""
    system = load_system(name).with_values(PLANS[name])
    with Session(system) as session:
        record = session.run()
    with observed_fits() as fits:
        system.reduce(record)
    protocol = protocol_of(system, record)
    assert isinstance(protocol, VisitProtocol)
    places = [j for j, _ in protocol.book]
    _, end = protocol.times(places, np.array([t for _, t in protocol.book]))
    assert end[-1] == pytest.approx(last_time(record), rel=2e-3)
    for (fit, _), channel in zip(fits, protocol.channels, strict=True):
        assert channel.names == tuple(q.name for q in fit.quantities[: len(channel.names)])
        rows = np.repeat(channel.rows[places], fit.y.size // len(places), axis=0)
        # linearized at estimates there and at the truth here: up to the noise of so short a run
        assert np.abs(rows - fit.X).max(axis=0) == pytest.approx(0.0, abs=5e-3 * float(np.abs(fit.X).max()))


def test_six_positions_a_mount_are_best_for_the_accelerometer() -> None:
    """Its model has no cosine of the third harmonic.  D-optimal for its eight unknowns are 30°, 90°, 150° ... in both
    mounts, 3/32 of the time at each of 30° and its like, 2/32 at 90° and 270°; equal stays at 24 positions need 11 %
    more time, all 24 being D-optimal for the seven terms of three harmonics.
    """
    model = importlib.import_module(".model", type(load_system("accelerometer_multipoint")).__module__)
    angle = np.tile(np.arange(24) * np.pi / 12, 2)
    v = model.Visits(np.repeat(["a", "b"], 24), angle, angle, angle, 0.0 * angle, 0.0)
    k, zeros = np.array([0.0, 1.0, 0.0, 0.0, 0.0, 0.0]), {"a": 0.0, "b": 0.0}
    m = model.Polynomial(["a", "b"], False)
    X = np.column_stack([m.columns(v, zeros, 1.0), m.slopes(v, zeros, 1.0, k)])
    M = np.einsum("mi,mj->mij", X, X)
    shares = np.zeros(48)
    shares[[2, 6, 10, 14, 18, 22, 26, 30, 34, 38, 42, 46]] = np.array([3, 2, 3, 3, 2, 3] * 2) / 32
    phi, gradient, _ = evaluate(M, np.eye(8), shares, "D")
    assert gradient.max() == pytest.approx(1.0, abs=1e-9)  # the equivalence theorem: nothing is better
    found = approximate_design(M, np.eye(8), "D", rounds=3000)
    assert found.value == pytest.approx(phi, rel=1e-3)
    assert evaluate(M, np.eye(8), np.full(48, 1 / 48), "D")[0] / phi == pytest.approx(1.1086, abs=1e-3)


@pytest.mark.long
def test_windows_of_a_tumble_are_those_of_its_reduction() -> None:
    """Choices of the single-axis tumble are compared without a run, by windows that must be those of one."""
    system = load_system("tumble_single_axis").with_values({"rate": "60 ERU", "dwell": "100s", "windows": 12})
    with Session(system) as session:
        record = session.run()
    with observed_fits() as fits:
        system.reduce(record)
    protocol = protocol_of(system, record)
    assert isinstance(protocol, OptionProtocol) and protocol.noise is not None
    length = 2.0 * np.pi / float(system["rate"])
    module = importlib.import_module(".design", type(system).__module__)
    setup = importlib.import_module(".reduction", type(system).__module__).Reduction.setup_of(record.run)
    X, t0, t1 = module._windows(system, setup, 1, 100.0 / length, length)
    fit = fits[0][0]
    assert pytest.approx(fit.X, abs=5e-4) == X
    assert t1[-1] == pytest.approx(float(fit.t_end[-1]), rel=5e-3)
    assert t1 - t0 == pytest.approx(fit.t_end - fit.t_start, rel=2e-2)


@pytest.mark.long
def test_the_shortest_method_of_north_finding() -> None:
    """Two methods, each as long as its own reduction needs; the system's own is among them and is not shorter."""
    system = load_system("north_finder").with_values({"level": "false", "windows": 24})
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(choice_search, "FINAL", 24)
        patch.setattr(choice_search, "ROUGH", 12)
        found = design_test(system, {"ψ": "0.5deg"})
    assert {n for n, _ in found.tried} == {"four", "tilt"}
    assert found.time <= found.book_time and found.values["ψ"].u == pytest.approx(0.5, rel=0.1)
    assert found.options["method"] in ("four", "tilt") and f"method={found.options['method']}" in found.command
    with pytest.raises(UsageError, match="choices of options: criterion minimax or A"):
        design_test(system, {"ψ": "0.5deg"}, criterion="D")


@pytest.fixture(scope="module")
def designed() -> Iterator[DesignedTest]:
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(plan_search, "EXCHANGES", 40)
        patch.setattr(plan_search, "numbers_of_visits", lambda search: [12])
        patch.setattr(shortest_test, "FINAL", 60)
        patch.setattr(shortest_test, "ROUGH", 20)
        yield design_test(load_system("accelerometer_multipoint"), {"k2": "0.5ug/g2"}, count=16)


@pytest.mark.long
def test_what_was_wanted_is_reached_and_counted(designed: DesignedTest) -> None:
    k2 = designed.values["k2"]
    assert k2.wanted == 0.5 and k2.u <= 0.5 * 1.02 and k2.error <= 0.5 * 1.02
    assert designed.time < 0.7 * designed.book_time and designed.time > designed.bound
    u, error, runs = designed.counted["k2"]
    assert runs == 16 and u == pytest.approx(k2.u, rel=0.25)  # standard error of the mean of 16, few degrees of freedom
    assert error == pytest.approx(k2.error, rel=0.55)  # three standard errors of a standard deviation of 16


@pytest.mark.long
def test_the_printed_command_is_the_plan(designed: DesignedTest) -> None:
    words = shlex.split(designed.command)
    assert words[:3] == ["gyrobench", "run", "accelerometer_multipoint"]
    system = load_system("accelerometer_multipoint")
    for setting in words[4::2]:
        system.set(*setting.split("=", 1))
    plan = system.plan()
    assert [p.label for p in plan.phases] == [label for label, _ in designed.plan]  # type: ignore[union-attr]
    assert str(designed).endswith(designed.command)


@pytest.mark.long
def test_the_prediction_is_what_drawn_data_give() -> None:
    """The same fit of 120 made records by hand: mean of the stated u and standard deviation of the estimates."""
    from gyrobench.reduction.estimation.linear_fit import fit
    from gyrobench.reduction.estimation.reported import Group

    t0 = np.arange(30) * 100.0
    X = np.column_stack([np.ones(30), np.cos(t0 / 500.0)])
    noise = DataNoise(3.0, 0.4, 150.0)
    L = np.linalg.cholesky(noise.covariance(t0, t0 + 60.0))
    rng = np.random.default_rng(3)

    def made() -> object:
        y = X @ [1.0, 2.0] + L @ rng.standard_normal(30)
        return fit(["a", "b"], X, y, t0, t0 + 60.0, [Group("", np.arange(30), t0, "t", "s")], "y", "1", 1.0)

    found = [made() for _ in range(120)]
    V = noise.covariance(t0, t0 + 60.0)
    p = predict(found[0], np.zeros((0, 2)), V, draws=60, seed=11)  # type: ignore[arg-type]
    u, values = np.array([f.u for f in found]), np.array([f.value for f in found])  # type: ignore[attr-defined]
    assert p.u == pytest.approx(u.mean(axis=0), rel=0.07)
    assert p.error == pytest.approx(values.std(axis=0), rel=0.2)
    # by hand: (X' V^-1 X)^-1
    assert p.least == pytest.approx(np.sqrt(np.diag(np.linalg.inv(X.T @ np.linalg.inv(V) @ X))), rel=1e-9)


def protocol(noise: DataNoise, settle: float) -> VisitProtocol:
    """A bias and a scale factor, read at -1 and at 1."""
    X = np.array([[1.0, -1.0], [1.0, 1.0]])
    channel = Channel(("b", "k"), X, np.eye(2), noise)
    return VisitProtocol(("-", "+"), (channel,), lambda a, b: 0.0, settle, lambda visits: {}, ((0, 1.0), (1, 1.0)))


def test_time_to_a_wanted_uncertainty_by_hand() -> None:
    """Variance of k from two visits of T: N^2/(2 T): u = 0.1 of N = 1 takes T = 50 s twice, and the settling."""
    search = Search(protocol(DataNoise(1.0), 3.0), (Want(0, 1, 0.1),), ((DataNoise(1.0),),))
    plan = finish(search, [0, 1], np.ones(2), None)
    assert plan.dwell == pytest.approx(50.0, rel=1e-3)
    assert plan.duration == pytest.approx(106.0, abs=0.2)
    assert plan_search.shortest_time(search, (DataNoise(1.0),))[0] == pytest.approx(103.0, rel=1e-3)


def test_the_dwell_is_that_of_the_run_where_u_falls_faster_than_the_noise() -> None:
    """A reduction with few degrees of freedom: u = (2 T)^-1/2 (200 s/T)^1.2.  By T' = T (u/0.1)^2 alone the error of
    log T would grow by 1 - 2 x 1.7 = -2.4 a round.
    """
    dwells: list[float] = []

    class Bench:
        def trial(self, values: dict[str, float], covariances: object, draws: int) -> Trial:
            dwells.append(values["dwell"])
            least = (2.0 * values["dwell"]) ** -0.5
            u = least * (200.0 / values["dwell"]) ** 1.2
            return Trial({"k": Stated(u, least, least, 0.0, "1", 1.0)}, 2.0 * values["dwell"], ())

    one = replace(protocol(DataNoise(1.0), 3.0), options=lambda visits: {"dwell": visits[0][1]})
    search = Search(one, (Want(0, 1, 0.1),), ((DataNoise(1.0),),))
    start = finish(search, [0, 1], np.ones(2), None)
    cost, plan, trial, _ = shortest_test._settled(Bench(), search, {"k": Want(0, 1, 0.1)}, start, None, 1)  # type: ignore[arg-type]
    assert plan.dwell == pytest.approx((200.0**1.2 / (0.1 * 2.0**0.5)) ** (1 / 1.7), rel=0.01)
    assert plan.dwell == dwells[-1] and cost == trial.time == 2.0 * plan.dwell  # what is stated is of the plan
    assert trial.values["k"].u == pytest.approx(0.1, rel=0.01) and len(dwells) < 9


@pytest.mark.parametrize(
    ("factors", "length"), [([1.06, 0.8, 0.98, 1.13, 1.04], 2), ([1.06, 1.03, 1.1, 1.05, 1.04], None)]
)
def test_the_shortest_length_that_got_there_counts(factors: list[float], length: int | None) -> None:
    """The effects that a fit weighs change from run to run, and u jumps: one of five lengths was reached, or none."""
    lengths: list[float] = []

    class Bench:
        def trial(self, values: dict[str, float], covariances: object, draws: int) -> Trial:
            lengths.append(values["dwell"])
            u = factors[len(lengths) - 1]
            return Trial({"k": Stated(u, u, u, 0.0, "1", 1.0)}, values["dwell"], ())

    def merit(trial: Trial) -> float:
        return trial.values["k"].u ** 2

    choice = Choice("one", lambda dwell: {"dwell": dwell}, 100.0)
    offered = OptionProtocol((choice,), lambda fits, record: (), ("k",))
    asked: Any = (Bench(), offered, choice, merit, None, 1)
    if length is None:
        with pytest.raises(DesignError, match=r"u/wanted stays at 1\.04"):
            choice_search._settled(*asked)
    else:
        found = choice_search._settled(*asked)
        assert found[0] == lengths[length] == found[1].time and found[2] == factors[length] ** 2


def test_slow_drift_is_beaten_by_more_visits_and_not_by_longer_ones() -> None:
    """Two visits of T: variance about sigma^2 tau/T = 0.04 at T = 2500 s.  Twenty short ones, 31 s apart: differences
    of neighbours have 1 - exp(-0.31) of the variance, a tenth of half of which is 0.013.
    """
    search = Search(protocol(noise := DataNoise(0.1, 1.0, 100.0), 30.0), (Want(0, 1, 0.2),), ((noise,),))
    two, many = (finish(search, [0, 1] * n, np.ones(2 * n), None) for n in (1, 10))
    assert two.duration == pytest.approx(5000.0, rel=0.1) and many.duration < 650.0


def test_drift_without_white_noise_sets_no_least_time() -> None:
    """What is left of the bound is the settling of a visit for what is wanted, 30 s."""
    search = Search(protocol(noise := DataNoise(0.0, 1.0, 100.0), 30.0), (Want(0, 1, 0.2),), ((noise,),))
    bound, optimum = plan_search.shortest_time(search, (noise,))
    assert bound == pytest.approx(30.0, abs=0.1) and optimum.shares == pytest.approx([0.5, 0.5], abs=0.01)


def test_no_visit_is_shorter_than_the_protocol_has_it() -> None:
    """50 s would be enough, see above."""
    one = replace(protocol(DataNoise(1.0), 3.0), least=60.0)
    assert finish(Search(one, (Want(0, 1, 0.1),), ((DataNoise(1.0),),)), [0, 1], np.ones(2), None).dwell == 60.0


def test_shares_are_rounded_in_proportion() -> None:
    assert rounded(np.array([0.5, 0.25, 0.25, 0.0]), 8).tolist() == [4, 2, 2, 0]
    assert rounded(np.array([0.9, 0.1, 0.0, 0.0]), 4, required=(3,)).tolist() == [2, 1, 0, 1]


@pytest.mark.parametrize(
    ("wants", "values", "error", "text"),
    [
        ({"k9": "1ug"}, {}, UsageError, "--want k9: no such value of this test"),
        ({"k2": "1mA"}, {}, UsageError, "--want k2=1mA"),
        ({"k2": "-1ug/g2"}, {}, UsageError, "above 0 is expected"),
        ({"k1": "1e-7"}, {"u_scale": "1e-6"}, DesignError, "the sources of type B alone make u = 10 times"),
        ({"k4": "1ug/g2"}, {"mounts": "a"}, UsageError, "--want k4: no such value"),
    ],
)
@pytest.mark.long
def test_what_cannot_be_reached_is_refused(
    wants: dict[str, str], values: dict[str, str], error: type[Exception], text: str
) -> None:
    with pytest.raises(error, match=text.replace("(", r"\(")):
        design_test(load_system("accelerometer_multipoint").with_values(values), wants)


def test_a_test_without_plans_is_refused_before_anything_runs(monkeypatch: pytest.MonkeyPatch) -> None:
    """The day of servo_polar took minutes first."""
    monkeypatch.setattr(Workbench, "run", None)
    with pytest.raises(DesignError, match="servo_polar offers no plans to choose from"):
        design_test(load_system("servo_polar"), {"D_I": "0.001deg/h/g"})


def test_the_tests_of_a_suite_that_reach_everything_soonest() -> None:
    """a alone reaches x; c both in 9 s; a and b both in 3 + 5 s; d is of no use."""
    times = {"a": 3.0, "b": 5.0, "c": 9.0, "d": 1.0}
    reached = {"a": {"x"}, "b": {"y"}, "c": {"x", "y"}, "d": set()}
    assert cheapest_cover(times, reached, {"x"}) == ("a",)
    assert cheapest_cover(times, reached, {"x", "y"}) == ("a", "b")
    assert cheapest_cover({**times, "c": 7.0}, reached, {"x", "y"}) == ("c",)
    assert cheapest_cover(times, reached, {"z"}) is None


def test_a_suite_says_why_it_has_no_design() -> None:
    suite = load_test("drift_test_suite")
    assert isinstance(suite, Suite)
    suite.set("tests", "servo_polar fixed_position")
    with pytest.raises(UsageError, match="state what is wanted"):
        design_suite(suite, {})
    with pytest.raises(
        DesignError, match=r"D_I: no test of drift_test_suite reaches it \(servo_polar: offers no plans"
    ):
        design_suite(suite, {"D_I": "1deg/h/g"})


def test_visits_as_text() -> None:
    found = parse_visits("visits", "a 30deg 20s; b 0.5rad ;a -15 2min", ("", "rad"), 10.0)
    assert [v.place[0] for v in found] == ["a", "b", "a"] and [v.dwell for v in found] == [20.0, 10.0, 120.0]
    assert [v.place[1] for v in found] == pytest.approx([np.pi / 6, 0.5, -np.pi / 12])
    for text, problem in (("a", "write 'NAME ANGLEdeg'"), ("a 30 0s", "must be above 0"), ("a 3A", "visit 1 'a 3A'")):
        with pytest.raises(InvalidValueError, match=problem):
            parse_visits("visits", text, ("", "rad"), 10.0)


@pytest.mark.long
def test_noise_of_a_run_takes_the_place_of_that_of_the_parts(tmp_path: Path) -> None:
    """A run with three times the white noise: its estimate, of 40 degrees of freedom, is within three of its standard
    errors, and what is predicted of the same plan goes with it.
    """
    name, values = "accelerometer_multipoint", {"dwell": "3s", "settle": "0.5s", "table.repeat": 0.0}
    noisy, quiet, other = (tmp_path / n for n in ("noisy", "quiet", "other"))
    white = 3.0 * 5.0e-6 * 9.80665
    gb.load(name, {**values, "accelerometer.white": white}).run(seed=5, out=noisy)
    system = load_system(name).with_values(values)
    gb.load(name, {**values, **dict.fromkeys(system.noises, 0.0)}).run(out=quiet)
    gb.load("fixed_position", dwell="60s").run(out=other)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(shortest_test, "_searched", lambda bench, protocol, own, *rest: (protocol, own))
        (_, own), (protocol, trial) = (
            design_test(system, {"k0": "1ug"}, **more)  # type: ignore[misc,arg-type]
            for more in ({}, {"noise_of": noisy})
        )
    three = pytest.approx(3.0, rel=3.0 / np.sqrt(80.0))
    assert trial.values["k0"].least / own.values["k0"].least == three
    assert trial.values["k0"].error / own.values["k0"].error == three
    assert any(f"the likeliest one of {noisy}, and visits are not shorter than" in u for u in protocol.unseen)
    assert protocol.least == pytest.approx(3.0)  # the dwell of the run
    for folder, text in (
        (quiet, "a run without noise"),
        (other, "a run of fixed_position; a run of accelerometer_mul"),
    ):
        with pytest.raises(UsageError, match=text):
            design_test(system, {"k0": "1ug"}, noise_of=folder)
    with pytest.raises(UsageError, match="runs have the noise of the parts"):
        design_test(system, {"k0": "1ug"}, noise_of=noisy, count=10)
    with pytest.raises(gb.GyrobenchError, match="No such file"):
        design_test(system, {"k0": "1ug"}, noise_of=tmp_path / "nothing")


@pytest.mark.long
def test_command_for_the_noise_of_a_run_with_flicker(gyrobench: Command, tmp_path: Path) -> None:
    """Its likeliest Gauss-Markov drift may have no white noise beside it, which its windows of a minute do not show."""
    folder = tmp_path / "run"
    noise = ("--seed", "1", "--set", "gyro.flicker=0.1deg/h", "--set", "gyro.markov=0")
    assert gyrobench("run", "tumble_two_axis", *noise, "--out", folder)[0] == 0
    code, said, _ = gyrobench("design", "tumble_two_axis", "--want", "D_I=0.1deg/h/g", "--noise", folder)
    assert code == 0
    assert "visits are not shorter than its windows of 60 s" in said and "spectrum of its drift is rather 1/f^1" in said
    assert "up to 0 times" not in said
    visits = shlex.split(said.splitlines()[-1])[-1]
    assert min(v.dwell for v in parse_visits("visits", visits.partition("=")[2], ("rad", "rad"), 0.0)) >= 60.0
