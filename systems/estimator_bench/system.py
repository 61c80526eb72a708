"""Bench of estimators: a signal whose truth is known, and what an estimator makes of it."""

from __future__ import annotations

import math
from typing import Any

from gyrobench.system.connectors import Socket, out
from gyrobench.system.part_values import PartValues
from gyrobench.system.system import Option, Slot, System
from gyrobench.system.values import InvalidValueError

from .benchmarks import BENCHMARKS, Benchmark

SOURCE = Socket(
    "SignalSource", "a noisy signal and its truth",
    (out("z", "", "the reading"), out("truth", "", "what an estimator should find")),
)  # fmt: skip


class EstimatorBench(System):
    """An estimator gets the readings of a source whose truth is known; its error, delay, noise reduction and distortion
    are measured, and whether it is what it says of itself.

    [BENCH-DYN-SINE, BENCH-DRIFT-LL, BENCH-DRIFT-AR3; Xia 2008, sections 3.4, 4.2-4.4]
    """

    title = "Bench of estimators"
    spec = ("BENCH-DYN-SINE", "BENCH-DRIFT-LL", "BENCH-DRIFT-AR3", "EST-KF-AR", "EST-SAGE-HUSA", "EST-WAVELET-ONLINE")
    slots = {"source": Slot(SOURCE, "signal_source"), "estimator": Slot("Estimator", "estimator_kalman_rate")}
    wires = """
        source.z -> estimator.z
    """
    options = {
        "benchmark": Option("sine", str, f"one of {', '.join(BENCHMARKS)}"),
        "samples": Option(0, int, "readings; 0: those of the benchmark", 0),
        "skip": Option(-1, int, "readings left out at the start; -1: those of the benchmark", -1),
    }
    channels = (
        "source.z", "source.truth", "estimator.estimate", "estimator.innovation", "estimator.R_hat", "estimator.nis",
        "estimator.variance", "estimator.latency",
    )  # fmt: skip
    shown = ("source.z source.truth estimator.estimate", "estimator.variance estimator.R_hat", "estimator.latency")

    @property
    def benchmark(self) -> Benchmark:
        return BENCHMARKS.get(self["benchmark"], BENCHMARKS["sine"])

    @property
    def samples(self) -> int:
        return int(self["samples"]) or self.benchmark.samples

    @property
    def skip(self) -> int:
        return int(self["skip"]) if self["skip"] >= 0 else self.benchmark.skip

    @property
    def step(self) -> float:
        """Return the sampling period of the benchmark: the source makes one reading a step, no other has a meaning."""
        return self.benchmark.Ts

    @step.setter
    def step(self, value: float) -> None:
        if not math.isclose(value, self.benchmark.Ts):
            raise InvalidValueError(
                f"step = {value:g} s: this system runs at the sampling period of its benchmark, "
                f"{self.benchmark.Ts:g} s (nothing in it is integrated: there is no step to check)"
            )

    @property  # both follow the benchmark: there is nothing to set
    def stop(self) -> float:  # type: ignore[override]
        return self.samples * self.step

    @property
    def channel_period(self) -> float:  # type: ignore[override]
        return self.step

    def parameters(self, parts: PartValues) -> dict[str, Any]:
        b = self.benchmark
        return {
            **{f"source.{k}": v for k, v in b.source.items()},
            "estimator.Ts?": b.Ts,
            **{f"estimator.{k}?": v for k, v in b.estimator.items()},
        }

    def check(self) -> list[str]:
        if self["benchmark"] not in BENCHMARKS:
            return [f"benchmark = {self['benchmark']}: one of {', '.join(BENCHMARKS)}"]
        left = self.samples - self.skip
        least = self.benchmark.least
        if left < least:
            return [f"samples = {self.samples}, of which {self.skip} are skipped: at least {least} must be left"]
        return []
