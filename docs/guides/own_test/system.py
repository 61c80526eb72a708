"""Six-position test: each axis of a floated gyro up and down, its current read in torque rebalance."""

import numpy as np

from gyrobench import attitudes, drift, frames, units
from gyrobench.reduction.estimation.fit_result import Effect, Group, Quantity, fit, linear_result
from gyrobench.reduction.setup.run_metadata import Site, number, truth_of
from gyrobench.system.families.option_groups import SETTLE, SITE, TORQUER, type_b
from gyrobench.system.families.rebalance_test import RebalanceTest
from gyrobench.system.plan import Phase, Plan
from gyrobench.system.system import Option

POSITIONS = ("U N", "-U N", "N U", "N -U", "N E", "N -E")  # input and output axis; in the last two S is down, up
NAMES = ("D_F", "D_I", "D_O", "D_S", "D_II", "D_SS")  # what they tell apart: no two axes share gravity


class SixPosition(RebalanceTest):
    title = "Six-position test"
    slots = RebalanceTest.with_parts(table="table_rate", gyro="floated_gyro", rebalance="rebalance_analog")
    options = SITE | TORQUER | SETTLE | type_b("scale_factor") | {"dwell": Option(600.0, "s", "time in a position")}

    def plan(self):
        each = {"mode": "index", "settle": self["settle"], "dwell": self["dwell"], "window": self["dwell"] / 10.0}
        faces = {p: attitudes.parse(p, self["latitude"]) for p in POSITIONS}
        return Plan([Phase(label=p, face=p, **each) for p in POSITIONS], faces)

    def reduce(self, record, specification=None):
        run, w = record.run, record.windows
        site, k, true = Site.of(run), number(run, "k", "gyro.k"), truth_of(run, NAMES) or {}
        axes = np.array([attitudes.parse(run.plan[p - 1].face, site.latitude) for p in w["phase"]])  # I, O, S in ENU
        rate = axes[:, 0] @ frames.earth_rate_local(site.latitude, site.earth_rate)
        columns = drift.regressors(-axes @ frames.U * site.g, NAMES)
        groups = [Group("six positions", np.arange(rate.size), w["t_start"] / 60.0, "time", "min")]
        found = fit([Quantity.drift(n, true.get(n)) for n in NAMES], columns, rate - k * w["mean"], w["t_start"],
                    w["t_end"], groups, "drift rate", "°/h", units.factor("deg/h"))  # fmt: skip
        scale = Effect("torquer scale factor", run.options["u_scale_factor"], "1", found.error(-k * w["mean"]))
        return linear_result(found, system=self.name, title=self.title, method="Least squares over six positions",
                             sources=[], equation='omega_d = omega_"IA" - k i', conventions=["k i = ω_IA − ω_d"],
                             effects=[scale], specification=specification, site=site.shown(),
                             instrument=run.instrument)  # fmt: skip
