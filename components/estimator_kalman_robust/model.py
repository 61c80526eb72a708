from __future__ import annotations

from gyrobench.component import Discrete, Output, Parameter, sampled
from gyrobench.component.blocks.estimator import RateFilter, chi_square_gate


class EstimatorKalmanRobust(RateFilter):
    """Kalman filter of a rate that wanders, for readings some of which are missing or wild.  [EST-KF-GEN, EST-KF-AR]

    Model, prediction and update are those of estimator_kalman_rate.  With the innovation y, S = P_xx + R and the gate
    g, which a chi-square variable of one degree of freedom exceeds with the probability 1 - p (p: `probability`),

        y2/S <= g    the reading is taken as it is
        y2/S >  g    it is wild: taken with R' = y2/g - P_xx in place of R, so that y2/(P_xx + R') = g

    Inflated, not thrown away: a wild reading moves the value by P_xx g / |y|, less the wilder it is, and the variance
    that the filter states hardly falls with it.  The `patience`-th wild reading in a row is taken for a change of the
    signal: P is inflated instead, P <- (y2/g - R)/P_xx P (patience = 0: never).  Where model and noise (normal) are
    right, one reading in 1/(1 - p) is called wild, and (1 - p)^patience of them restart the filter: 0.001 and 1e-15 by
    default.

    nis = y2/S of every reading, wild or not; wild: 1 while the last reading was; wild_count, restarts: how often.
    valid = 0: prediction only.

    Not modelled: several readings at a time, wild readings that agree with each other for longer than `patience`.
    Source: EST-KF-GEN, EST-KF-AR; gate and inflation of R: Chang 2014; inflation of P: own design.
    """

    version = "1.0.0"

    probability = Parameter(
        0.999, "1", "probability that the gate lets an ordinary reading pass", min=0.5, max=1.0 - 1e-9
    )
    patience = Parameter(5, int, "wild readings in a row that are taken for a change of the signal; 0: never", min=0)

    gate = Output("1", "largest nis of a reading that is not wild")
    wild = Output("1", "1: the last reading was wild")
    wild_count = Output("1", "wild readings so far")
    restarts = Output("1", "changes of the signal so far")

    g = Discrete(0.0, "1", "gate")
    beyond = Discrete(0.0, "1", "1: the last reading was wild")
    wilds = Discrete(0.0, "1", "wild readings")
    row = Discrete(0.0, "1", "wild readings in a row")
    changes = Discrete(0.0, "1", "changes of the signal")

    def start(self) -> None:
        self.g = chi_square_gate(self.probability)
        self.beyond = 0.0
        self.wilds = 0.0
        self.row = 0.0
        self.changes = 0.0

    @sampled(every=1)
    def tick(self) -> None:
        if self.reading > 0.5:
            self.predict()
            if self.valid > 0.5:
                self.judge()
                self.beyond = 1.0 if self.e > self.g else 0.0
                if self.beyond < 0.5:
                    self.row = 0.0
                    self.update(self.R)
                else:
                    self.wilds = self.wilds + 1.0
                    self.row = self.row + 1.0
                    total = self.y * self.y / self.g  # the variance with which the innovation is at the gate
                    if self.row == self.patience and self.P_xx > 0.0:
                        factor = (total - self.R) / self.P_xx
                        self.P_xx = factor * self.P_xx
                        self.P_xv = factor * self.P_xv
                        self.P_vv = factor * self.P_vv
                        self.row = 0.0
                        self.changes = self.changes + 1.0
                        self.update(self.R)
                    else:
                        self.update(total - self.P_xx)

    def outputs(self) -> None:
        self.gate = self.g
        self.wild = self.beyond
        self.wild_count = self.wilds
        self.restarts = self.changes
