from __future__ import annotations

from gyrobench.component import Component, Discrete, Input, Output, Parameter, sampled
from gyrobench.component.math import Number, fabs, floor

MODES = 5
OFF = [0.0] * MODES
PRESSURE, RATE, TEMPERATURE, ENCODER, SPEED, TWO, TACHO = 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0
REASONS = 7


class ModeSupervisor(Component):
    """Chooses the mode of a table: one error source at a time, presets on a switch, interlocks.  [TABLE-MODES]

    Requests, one for each mode, and what feeds the servo amplifier then:

        1 servo             pickoff of the gyro            4 program      sequencer (rate or position counts)
        2 synchronous rate  command counts - encoder       5 tacho rate   set point - tachometer
        3 position          the same, at rest at the end

    `select` has exactly one 1 while the motor is on, none otherwise; `preset` is 1 for one sample after a switch, so
    that the compensator begins with the states of the new error.  A request is not followed, and `reason` says why,
    where

        1 pressure of the air below pressure_min           4 encoder lost, modes 2 to 4, which it feeds
        2 rate above rate_max                              5 change of mode above rate_change (bumpless = 0)
        3 temperature above temperature_max                6 two requests at once
        7 tachometer feedback still on in a mode of drift runs: 2 to 4, or 1 later than capture_max after its begin

    1 to 4 and 7 switch a running motor off too, after `confirm` samples in a row, and stay so (`tripped`, time
    `t_trip`) until no mode is requested and `clear` is given.  6 while running keeps the mode that is on.  Sampled
    every `period`.

    Not modelled: contactors, brake (a table without motor runs out on its bearing), motor current.
    Source: Hu 1981, sections 5.2..5.4, 6.1 (items 1, 6); logic: our own.
    """

    version = "1.1.0"

    period = Parameter(0.01, "s", "sampling period", above=0.0)
    pressure_min = Parameter(4e5, "Pa", "lowest pressure of the air bearing", above=0.0)
    rate_max = Parameter(10.0, "rad/s", "largest rate", above=0.0)
    temperature_max = Parameter(343.15, "K", "largest temperature of the motor", above=0.0)
    rate_change = Parameter(1e-3, "rad/s", "largest rate for a change of mode", above=0.0)
    bumpless = Parameter(False, bool, "1: the mode may be changed at any rate, by presets")
    capture_max = Parameter(10.0, "s", "longest capture, in which mode 1 has tachometer feedback", min=0.0)
    confirm = Parameter(2, int, "samples in a row until the motor is switched off", min=1, max=100)

    request = Input(OFF, "1", "requests of the modes: servo, synchronous rate, position, program, tacho rate")
    pressure = Input(6e5, "Pa", "pressure of the air bearing")
    rate = Input(0.0, "rad/s", "rate of the table")
    temperature = Input(293.15, "K", "temperature of the motor")
    lost = Input(0.0, "1", "other than 0: the encoder has lost its count")
    tacho = Input(0.0, "1", "other than 0: feedback of the tachometer is on, beside the error source")
    clear = Input(0.0, "1", "other than 0: a trip is taken back, with no mode requested")

    mode = Output("1", "mode that is on, 0: motor off")
    enable = Output("1", "1: motor on")
    select = Output("1", "error source that feeds the amplifier, one of five", shape=(5,))
    preset = Output("1", "1 in the sample after a switch")
    reason = Output("1", "why the request is not followed, or why the motor was switched off; 0: it is followed")
    tripped = Output("1", "1 from a trip until it is taken back")
    t_trip = Output("s", "time of the last trip; -1: none")

    on = Discrete(0.0, "1", "mode that is on")
    strobe = Discrete(0.0, "1", "preset")
    why = Discrete(0.0, "1", "reason")
    trip = Discrete(0.0, "1", "tripped")
    when = Discrete(-1.0, "s", "time of the trip")
    begun = Discrete(0.0, "s", "time of the last switch")
    fails = Discrete([0.0] * REASONS, "1", "samples in a row in which an interlock was open")
    next = Discrete(0.0, "1", "number of the next sample")

    def start(self) -> None:
        self.when = -1.0
        self.next = 0.0

    def interlock(self, mode: Number) -> Number:
        """Return the first interlock that is open for a mode, 0: none."""
        if self.pressure < self.pressure_min:
            return PRESSURE
        if fabs(self.rate) > self.rate_max:
            return RATE
        if self.temperature > self.temperature_max:
            return TEMPERATURE
        if self.lost != 0.0 and mode >= 2.0 and mode <= 4.0:
            return ENCODER
        captured = mode == 1.0 and self.on == 1.0 and self.t - self.begun > self.capture_max
        if self.tacho != 0.0 and (captured or (mode >= 2.0 and mode <= 4.0)):
            return TACHO
        return 0.0

    def follow(self) -> None:
        """Take one sample."""
        self.strobe = 0.0
        wanted = 0.0
        many = 0.0
        for k in range(MODES):
            if self.request[k] != 0.0:
                wanted = k + 1.0
                many = many + 1.0
        if self.trip != 0.0:
            if many == 0.0 and self.clear != 0.0:
                self.trip = 0.0
                self.why = 0.0
            return
        if self.on != 0.0:
            open_now = self.interlock(self.on)
            for k in range(REASONS):
                self.fails[k] = self.fails[k] + 1.0 if open_now == k + 1.0 else 0.0
                if self.fails[k] >= self.confirm:
                    self.trip = 1.0
                    self.why = open_now
                    self.when = self.t
                    self.on = 0.0
            if self.trip != 0.0:
                for k in range(REASONS):
                    self.fails[k] = 0.0
                return
        if many > 1.0:
            self.why = TWO
        elif wanted == self.on:
            self.why = 0.0
        elif wanted == 0.0:
            self.on = 0.0
            self.why = 0.0
        else:
            self.why = self.interlock(wanted)
            if self.why == 0.0 and self.on != 0.0 and not self.bumpless and fabs(self.rate) > self.rate_change:
                self.why = SPEED
            if self.why == 0.0:
                self.on = wanted
                self.strobe = 1.0
                self.begun = self.t

    @sampled(every=1)
    def tick(self) -> None:
        if self.t >= (self.next - 1e-6) * self.period:
            self.next = floor(self.t / self.period + 1e-6) + 1.0
            self.follow()

    def outputs(self) -> None:
        self.mode = self.on
        self.enable = 1.0 if self.on > 0.0 else 0.0
        for k in range(MODES):
            self.select[k] = 1.0 if self.on == k + 1.0 else 0.0
        self.preset = self.strobe
        self.reason = self.why
        self.tripped = self.trip
        self.t_trip = self.when
