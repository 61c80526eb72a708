from __future__ import annotations

from typing import ClassVar

from gyrobench.component import Component, Discrete, Input, Output, Parameter, State, sampled
from gyrobench.component.math import Number, clip, floor, pi


class AcquisitionCard(Component):
    """Acquisition of a gyro signal: amplifier with RC filter, sampling, analog-to-digital converter.  [ACQ-CARD]

        RC       x' = 2 pi f_c (z - x)                       f_c = 0: x = z
        sampled  s = x at every period, held between; period 0: at every communication step
        ADC      code = round(gain s / lsb), limited to -2^(bits-1) .. 2^(bits-1) - 1,     lsb = span / 2^(bits-1)
                 estimate = code lsb / gain

    f_c = 720 Hz, 14 bits over +-5 V: lsb = 0.610 mV.  The filter is exact for a z that is held over the communication
    step.  latency: 1 / (2 pi f_c), and half a period.

    Not modelled: noise, offset and nonlinearity of amplifier and converter, its conversion time (2.2 us), aliasing by a
    signal that changes within a communication step.
    Source: Xia 2008, section 4.2 (RC, 720 Hz), 4.4.1 (AD7899, 14 bits, +-5 V, 0.6 mV).
    """

    version = "1.0.0"
    unrounded: ClassVar[dict[str, float]] = {"bits": 0.0}
    sampling_parameter = "period"

    f_c = Parameter(720.0, "Hz", "corner of the RC filter; 0: none", min=0.0)
    gain = Parameter(1.0, "1", "volts at the converter per unit of z", above=0.0)
    bits = Parameter(14, int, "bits of the converter; 0: no rounding", min=0, max=32)
    span = Parameter(5.0, "V", "span of the converter, largest voltage of each sign", above=0.0)
    period = Parameter(0.0, "s", "sampling period; 0: every communication step", min=0.0)

    z = Input(0.0, "1", "signal")

    estimate = Output("1", "signal as the computer has it, unit of z")
    latency = Output("s", "delay of the estimate")
    overload = Output("1", "1 while the signal is beyond the range")

    x = State(0.0, "1", "signal behind the filter")

    held = Discrete(0.0, "1", "sample of the filtered signal")
    codes = Discrete(8192.0, "1", "codes of one sign")
    lsb = Discrete(0.0, "V", "voltage of a code")
    since = Discrete(0.0, "1", "communication steps since it was taken")

    def start(self) -> None:
        self.refuse(self.bits == 1.0, "bits = 1: 2 to 32, or 0 for none")
        codes = 1.0
        for k in range(31):
            codes = 2.0 * codes if k < self.bits - 1.0 else codes
        self.codes = codes
        self.lsb = self.span / codes
        self.x = self.z
        self.held = self.z
        self.since = 0.0

    def filtered(self) -> Number:
        return self.x if self.f_c > 0.0 else self.z

    def flow(self) -> None:
        self.der.x = 2.0 * pi * self.f_c * (self.z - self.x)

    @sampled(every=1)
    def tick(self) -> None:
        self.since = self.since + 1.0
        many = floor(self.period / self.h + 0.5)
        odd = self.period > 0.0 and (many * self.h > self.period * 1.000001 or many * self.h < self.period * 0.999999)
        self.refuse(odd, "period = {period} s is not a multiple of the internal step")
        if self.since >= many:
            self.since = 0.0
            self.held = self.filtered()

    def outputs(self) -> None:
        sample = self.held if self.period > 0.0 else self.filtered()
        code = self.gain * sample / self.lsb
        code = floor(code + 0.5) if self.bits > 0.5 else code
        kept = clip(code, -self.codes, self.codes - 1.0 if self.bits > 0.5 else self.codes)
        self.estimate = kept * self.lsb / self.gain
        self.overload = 1.0 if kept != code else 0.0
        delay = 1.0 / (2.0 * pi * self.f_c) if self.f_c > 0.0 else 0.0
        self.latency = delay + 0.5 * self.period
