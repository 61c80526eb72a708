from __future__ import annotations

from gyrobench.component import Output, sampled
from gyrobench.component.blocks.estimator import RateFilter


class EstimatorKalmanRate(RateFilter):
    """Kalman filter of a rate that wanders: value and slope, or a level alone.  [EST-KF-GEN, EST-KF-AR: GyroRateKf]

        x = (value, slope),   F = [[1, T], [0, 1]],   H = [1 0],   T = Ts,   var of a reading R
        G Q G' = q [[T3/3, T2/2], [T2/2, T]] + walk [[T, 0], [0, 0]]

    q is the density of the white noise that drives the slope (integrated random walk), walk that of the white noise
    that drives the value itself.  With q = 0 and P0_slope = 0 the slope stays 0 and the filter is that of the local
    level: random walk plus white noise, the model that the drift data of Xia 2008 supports.  At each reading

        x- = F x,   P- = F P F' + G Q G'
        y  = z - H x-,   S = H P- H' + R,   K = P- H' / S
        x  = x- + K y,   P = (I - K H) P- (I - K H)' + K R K'      (Joseph form)

    and with valid = 0 only the first line: the reading is missing.  nis = y2/S; variance = P_11 of the estimate.
    q = 0.1 ... 0.5 suits BENCH-DYN-SINE: a rate of 1 Hz and 0.01 under noise of 1.643e-3 at 1 kHz (units of z).

    Not modelled: a bias.  Rate and drift are not separable with one gyro: a bias state needs a reference.
    Source: EST-KF-GEN, EST-KF-AR; Xia 2008, eq. 4.2.1-4.2.18; the model is our own.
    """

    version = "1.0.0"

    latency = Output("s", "delay of the estimate")

    @sampled(every=1)
    def tick(self) -> None:
        if self.reading > 0.5:
            self.predict()
            if self.valid > 0.5:
                self.judge()
                self.update(self.R)

    def outputs(self) -> None:
        self.latency = 0.0
