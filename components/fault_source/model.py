from __future__ import annotations

from gyrobench.component import Component, Discrete, Input, Output, Parameter, sampled
from gyrobench.component.math import Number, exp, floor

FAULTS = 60
NONE = [0.0] * FAULTS
BEGIN, RECORD = 0.2, 0.05  # s: clearing at the start of a turn, time between the row of the record and its end


class FaultSource(Component):
    """Signals of a table's electronics with faults put in one after the other, for the test of monitor and supervisor.

    First a quiet time without faults, in which every alarm or trip is counted and cleared.  Then turns of `turn`
    seconds: 0.2 s cleared and without a mode, then synchronous rate; the fault comes at `at[k]` after the start of
    turn k and stays to its end, 0.05 s before which `count` rises.  Kinds (0: none), two at once by `second`:

        1 air pressure falls to 2e5 Pa, time constant tau      5 supply falls to 20 V
        2 rate command goes to 15 rad/s                        6 pulses of 60 Hz
        3 motor heats towards 383 K, time constant tau         7 duty 0.65
        4 encoder lost                                         8 amplitude 3.5 V

    Nominal: 6e5 Pa, 0.5 rad/s, 308 K, 24 V, pulses of 50 Hz, duty 0.5, 5 V.  x: supply, motor temperature, pressure,
    rate. Not modelled: faults that come and go, or that cause one another.
    Source: CTRL-SUPERVISION; kinds and sizes are our own.
    """

    version = "1.0.0"
    SUPPLY, TEMPERATURE, PRESSURE, RATE = 24.0, 308.0, 6e5, 0.5  # V, K, Pa, rad/s: nominal
    FALL, RISE = 4e5, 75.0  # Pa, K: of pressure and temperature in the end

    step = Parameter(1e9, "s", "largest internal step: one sample for each communication step", above=0.0)
    quiet = Parameter(60.0, "s", "time without faults at the start", min=1.0)
    turn = Parameter(3.0, "s", "length of a turn", min=1.0)
    n = Parameter(0, int, "turns", min=0, max=60)
    kind = Parameter(NONE, "1", "fault of each turn, 0 to 8")
    second = Parameter(NONE, "1", "second fault of each turn, 0 to 8")
    at = Parameter([1.0] * FAULTS, "s", "time of the fault from the start of its turn", min=0.3)
    tau = Parameter(0.5, "s", "time constant of pressure and temperature", above=0.0)

    alarm = Input(0.0, "1", "alarm of the monitor")
    tripped = Input(0.0, "1", "trip of the supervisor")
    rate = Input(0.0, "rad/s", "rate of the table")

    x = Output("1", "scalars: supply, motor temperature, air pressure, rate; 0", shape=(8,))
    pulse = Output("V", "pulse train")
    pressure = Output("Pa", "air pressure")
    temperature = Output("K", "motor temperature")
    lost = Output("1", "1: the encoder has lost its count")
    target = Output("rad/s", "rate command")
    request = Output("1", "requests of the five modes", shape=(5,))
    clear = Output("1", "1: alarms and trips are taken back")
    count = Output("1", "turns that are done, one for the quiet time")
    fault = Output("1", "fault of the turn")
    also = Output("1", "second fault of the turn")
    t_fault = Output("s", "time of the fault, -1 in the quiet time")
    false_alarms = Output("1", "alarms and trips of the quiet time")
    done = Output("1", "1 at the end of the last turn")

    now = Discrete(0.0, "1", "turn, from 1; 0 the quiet time")
    since = Discrete(0.0, "s", "time since its start")
    first = Discrete(0.0, "1", "fault that is on")
    other = Discrete(0.0, "1", "second fault that is on")
    age = Discrete(0.0, "s", "time since the fault")
    rows = Discrete(0.0, "1", "turns done")
    counted = Discrete(0.0, "1", "alarms of the quiet time")
    clearing = Discrete(0.0, "1", "clear")
    cycle = Discrete(0.0, "1", "phase of the pulse train, in periods")
    ended = Discrete(0.0, "1", "done")

    def start(self) -> None:
        for k in range(FAULTS):
            wrong = self.kind[k] < 0.0 or self.kind[k] > 8.0 or self.second[k] < 0.0 or self.second[k] > 8.0
            self.refuse(k < self.n and wrong, "kind, second: a fault is 1 to 8, or 0 for none")
            self.refuse(k < self.n and self.at[k] > self.turn - 0.5, "at: 0.5 s must be left to the end of the turn")

    def on(self, kind: Number) -> Number:
        """Return 1 while a fault of this kind is on."""
        return 1.0 if self.first == kind or self.other == kind else 0.0

    @sampled(every=1)
    def tick(self) -> None:
        self.now = 0.0
        self.since = self.t
        if self.t >= self.quiet - 1e-9:
            self.now = floor((self.t - self.quiet) / self.turn + 1e-9) + 1.0
            self.since = self.t - self.quiet - (self.now - 1.0) * self.turn
        if self.now > self.n:
            self.ended = 1.0
            self.now = self.n
            self.since = self.turn
        self.first = 0.0
        self.other = 0.0
        self.age = 0.0
        for k in range(FAULTS):
            if self.now == k + 1.0 and self.since >= self.at[k] - 1e-9:
                self.first = self.kind[k]
                self.other = self.second[k]
                self.age = self.since - self.at[k]
        if self.now == 0.0:
            flagged = self.alarm != 0.0 or self.tripped != 0.0
            if flagged and self.clearing == 0.0:
                self.counted = self.counted + 1.0
            self.clearing = 1.0 if flagged else 0.0
        else:
            self.clearing = 1.0 if self.since < BEGIN else 0.0
        length = self.quiet if self.now == 0.0 else self.turn
        self.rows = self.now + (1.0 if self.since >= length - RECORD else 0.0)
        frequency = 60.0 if self.on(6.0) > 0.0 else 50.0
        self.cycle = self.cycle + frequency * self.h
        self.cycle = self.cycle - floor(self.cycle)

    def outputs(self) -> None:
        settled = 1.0 - exp(-self.age / self.tau)
        self.pressure = self.PRESSURE - self.FALL * settled * self.on(1.0)
        self.temperature = self.TEMPERATURE + self.RISE * settled * self.on(3.0)
        self.target = 15.0 if self.on(2.0) > 0.0 else self.RATE
        self.lost = self.on(4.0)
        self.x[0] = 20.0 if self.on(5.0) > 0.0 else self.SUPPLY
        self.x[1] = self.temperature
        self.x[2] = self.pressure
        self.x[3] = self.rate
        for j in range(4):
            self.x[j + 4] = 0.0
        high = 3.5 if self.on(8.0) > 0.0 else 5.0
        self.pulse = high if self.cycle < (0.65 if self.on(7.0) > 0.0 else 0.5) else 0.0
        for k in range(5):
            self.request[k] = 0.0
        if self.clearing == 0.0 and self.ended == 0.0:
            self.request[1] = 1.0
        self.clear = self.clearing
        self.count = self.rows
        self.fault = 0.0
        self.also = 0.0
        self.t_fault = -1.0
        for k in range(FAULTS):
            if self.now == k + 1.0:
                self.fault = self.kind[k]
                self.also = self.second[k]
                self.t_fault = self.quiet + k * self.turn + self.at[k]
        self.false_alarms = self.counted
        self.done = self.ended
