from __future__ import annotations

from gyrobench.component import Discrete, Input, Noise, Output, Parameter, State, sampled
from gyrobench.component.blocks.gyro import DEG_H
from gyrobench.component.component import Component
from gyrobench.component.math import floor, pi, sqrt

ARCSEC = pi / 648000.0


class DriftingTable(Component):
    """Table held at rest by a gyro, as the drift of the gyro moves it; beside it the same table without compensation.

    [COMP-RANDOM-DRIFT]

        M' = -M/tau + w      alpha' = M + white + k (1 + k_error) i       theta' = (alpha - theta)/lag
        theta_read = theta + noise of the reading, in quanta             (k i = omega_IA - omega_d)

    M is a Gauss-Markov drift, stationary from the start: w is white, of the density that gives M the variance drift2,
    held over an internal step (M, alpha and theta then belong together to second order in step/lag).

    alpha is the angle that the gyro commands, theta the angle of the table, which follows with the lag of its servo.
    alpha_free and theta_free are those with i = 0: the same drift, not compensated.

    A run is a row of records: after each `length` the table is set to zero (restart = 1 for one communication step),
    while the drift goes on.  Records are independent where `length` is several tau.

    Not modelled: Earth rate (known, taken off), dynamics of float and servo beyond the lag, drift that depends on the
    acceleration, errors of the angle system beyond noise and quantum.
    Source: COMP-RANDOM-DRIFT; Hu 1981, eq. 6-24..6-27.
    """

    version = "1.0.0"

    step = Parameter(0.2, "s", "largest internal step, a small part of lag", above=0.0)
    drift = Noise(0.01 * DEG_H, "rad/s", "rms of the Gauss-Markov drift (0.01 deg/h)", per="step")
    drift_tau = Parameter(3600.0, "s", "its correlation time", above=0.0)
    white = Noise(0.0, "rad/s/sqrt(Hz)", "white drift density")
    lag = Parameter(1.0, "s", "time constant of the table servo", above=0.0)
    k = Parameter(17.2e3 * DEG_H, "rad/s/A", "torquer scale factor (17.2 deg/h/mA)", above=0.0)
    k_error = Parameter(0.0, "1", "relative error of the torquer scale factor")
    reading = Noise(0.2 * ARCSEC, "rad", "standard deviation of an angle reading (0.2 arcsec)", per="step")
    quantum = Parameter(0.0, "rad", "quantum of the angle reading; 0: none", min=0.0)
    length = Parameter(21600.0, "s", "length of a record, a whole multiple of the communication step", above=0.0)

    i = Input(0.0, "A", "torquer current")

    theta_read = Output("rad", "table angle as read")
    restart = Output("1", "1 in the step in which a record begins")
    record = Output("1", "number of the record, from 1")
    M = Output("rad/s", "Gauss-Markov drift")
    alpha = Output("rad", "angle commanded by the gyro")
    theta = Output("rad", "table angle")
    theta_free = Output("rad", "table angle without compensation")

    drift_state = State(0.0, "rad/s", "Gauss-Markov drift")
    alpha_state = State(0.0, "rad", "angle commanded by the gyro")
    theta_state = State(0.0, "rad", "table angle")
    alpha_0 = State(0.0, "rad", "angle commanded by the gyro, without compensation")
    theta_0 = State(0.0, "rad", "table angle, without compensation")
    number = Discrete(1.0, "1", "number of the record")
    begins = Discrete(1.0, "1", "1 in the step in which a record begins")

    def start(self) -> None:
        self.drift_state = self.noise.drift

    def flow(self) -> None:
        rate = self.drift_state + self.noise.white
        self.der.drift_state = (
            sqrt(2.0 / (self.drift_tau * self.h)) * self.noise.drift - self.drift_state / self.drift_tau
        )
        self.der.alpha_state = rate + self.k * (1.0 + self.k_error) * self.i
        self.der.theta_state = (self.alpha_state - self.theta_state) / self.lag
        self.der.alpha_0 = rate
        self.der.theta_0 = (self.alpha_0 - self.theta_0) / self.lag

    @sampled(every=1)
    def tick(self) -> None:
        self.begins = 0.0
        if self.t > self.step_end - 0.5 * self.h and floor(self.t / self.length + 1e-9) >= self.number:
            self.number = self.number + 1.0
            self.begins = 1.0
            self.alpha_state = 0.0
            self.theta_state = 0.0
            self.alpha_0 = 0.0
            self.theta_0 = 0.0

    def outputs(self) -> None:
        angle = self.theta_state + self.noise.reading
        if self.quantum > 0.0:
            angle = self.quantum * floor(angle / self.quantum + 0.5)
        self.theta_read = angle
        self.restart = self.begins
        self.record = self.number
        self.M = self.drift_state
        self.alpha = self.alpha_state
        self.theta = self.theta_state
        self.theta_free = self.theta_0
