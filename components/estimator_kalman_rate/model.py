from __future__ import annotations

from gyrobench.component import Discrete, Output, Parameter, sampled
from gyrobench.component.blocks.estimator import KalmanEstimator


class EstimatorKalmanRate(KalmanEstimator):
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

    q = Parameter(0.5, "1/s3", "density of the white noise that drives the slope, (unit of z)2/s3", min=0.0)
    walk = Parameter(0.0, "1/s", "density of the white noise that drives the value, (unit of z)2/s", min=0.0)
    R = Parameter(2.699449e-6, "1", "variance of the noise of one reading, (unit of z)2", above=0.0)
    P0 = Parameter(1.0, "1", "variance of the value at the start, (unit of z)2", min=0.0)
    P0_slope = Parameter(1.0, "1/s2", "variance of the slope at the start, (unit of z)2/s2", min=0.0)

    latency = Output("s", "delay of the estimate")

    x = Discrete(0.0, "1", "value")
    v = Discrete(0.0, "1/s", "slope")
    P_xx = Discrete(0.0, "1", "variance of the value")
    P_xv = Discrete(0.0, "1/s", "covariance of value and slope")
    P_vv = Discrete(0.0, "1/s2", "variance of the slope")

    def start(self) -> None:
        self.x = 0.0
        self.v = 0.0
        self.P_xx = self.P0
        self.P_xv = 0.0
        self.P_vv = self.P0_slope

    @sampled(every=1)
    def tick(self) -> None:
        if self.reading > 0.5:
            T = self.Ts
            self.x = self.x + T * self.v
            self.P_xx = self.P_xx + T * (2.0 * self.P_xv + T * self.P_vv) + self.q * T * T * T / 3.0 + self.walk * T
            self.P_xv = self.P_xv + T * self.P_vv + 0.5 * self.q * T * T
            self.P_vv = self.P_vv + self.q * T
            self.y = 0.0
            self.e = 0.0
            if self.valid > 0.5:
                self.y = self.z - self.x
                variance = self.P_xx + self.R
                self.e = self.y * self.y / variance
                k = self.P_xx / variance
                g = self.P_xv / variance
                self.x = self.x + k * self.y
                self.v = self.v + g * self.y
                a = 1.0 - k
                xx = self.P_xx
                xv = self.P_xv
                self.P_xx = a * a * xx + k * k * self.R
                self.P_xv = a * (xv - g * xx) + k * g * self.R
                self.P_vv = self.P_vv - 2.0 * g * xv + g * g * xx + g * g * self.R

    def outputs(self) -> None:
        self.estimate = self.x
        self.variance = self.P_xx
        self.latency = 0.0
