from __future__ import annotations

from gyrobench.component import Discrete, Input, Noise, Output, Parameter, Rotation, sampled
from gyrobench.component.blocks.table import AxisTable
from gyrobench.component.math import cos, sin
from gyrobench.component.set_up import each


class RateTableVibrating(AxisTable):
    """Rate table with angular vibration about its axis: it follows an exciter.  [TEST-BANDWIDTH]

        angle, rate, acc = third element of motion_angle, motion_rate, motion_acceleration
        spin    = (angle - angle of the step before) / h + Earth rate along the axis
        omega   = face (w + (0, 0, spin)),   w: Earth rate across the axis, as of the other tables; f likewise
        rate_read = (1 + read_gain) (rate - read_lag acc) + noise

    omega is the mean of the step, so that what integrates it loses no angle, and a gyro that holds it sees a sine of
    the right phase, smaller by (pi f h)2/6; alpha likewise, (rate - rate of the step before) / h along the axis.
    read_lag: the reading is late by it, to first order in 2 pi f read_lag.
    Not modelled: servo and resonances of the table, motion about other axes, distance of the gyro from the axis.
    Source: IEEE 1431, frequency response; frames: CONV-FRAMES.
    """

    version = "1.1.0"

    simulates = (each("read_gain", ("table.reading.gain",)), each("read_lag", ("table.reading.lag",)))

    step = Parameter(1e9, "s", "largest internal step: one for each communication step", above=0.0)
    face = Rotation("mount: rows are the gyro axes in table axes")
    read_gain = Parameter(0.0, "1", "relative error of the reading of the rate", min=-0.5, max=0.5)
    read_lag = Parameter(0.0, "s", "time by which the reading of the rate is late", min=-1e-2, max=1e-2)
    reading = Noise(0.0, "rad/s/sqrt(Hz)", "white noise of the reading")

    motion_angle = Input([0.0, 0.0, 0.0], "rad", "motion asked for; the third is about the table axis")
    motion_rate = Input([0.0, 0.0, 0.0], "rad/s", "its rate")
    motion_acceleration = Input([0.0, 0.0, 0.0], "rad/s2", "its acceleration")

    rate_read = Output("rad/s", "table rate as read")

    before = Discrete(0.0, "rad", "angle of the step before")
    mean = Discrete(0.0, "rad/s", "mean rate of the step")
    rate_before = Discrete(0.0, "rad/s", "rate of the step before")
    mean_acc = Discrete(0.0, "rad/s2", "mean acceleration of the step")

    def start(self) -> None:
        self.before = self.motion_angle[2]
        self.mean = self.motion_rate[2]
        self.rate_before = self.motion_rate[2]
        self.mean_acc = self.motion_acceleration[2]

    @sampled(every=1)
    def tick(self) -> None:
        self.mean = (self.motion_angle[2] - self.before) / self.h
        self.before = self.motion_angle[2]
        self.mean_acc = (self.motion_rate[2] - self.rate_before) / self.h
        self.rate_before = self.motion_rate[2]

    def outputs(self) -> None:
        self.angle = self.motion_angle[2]
        self.rate = self.motion_rate[2]
        c = cos(self.angle)
        s = sin(self.angle)
        acc = self.motion_acceleration[2]
        self.feel(c, s, self.tilted[2] @ self.omega_local + self.mean, self.rate, self.mean_acc)
        self.angle_read = self.angle
        self.rate_read = (1.0 + self.read_gain) * (self.rate - self.read_lag * acc) + self.noise.reading
