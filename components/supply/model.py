from __future__ import annotations

from gyrobench.component import Component, Output, Parameter
from gyrobench.component.blocks.gyro import GaussMarkov
from gyrobench.component.blocks.supply import Departure
from gyrobench.component.math import pi, sin
from gyrobench.component.set_up import each


class Supply(Component):
    """Electrical supplies of a gyro, how far they are off their nominal values; fits the socket Supply.

    Each of the five outputs, by parameters of its own:

        departure = offset + ramp t + step (from t = step_time on) + swing sin(2 pi t / period + phase) + wander

    wheel_frequency, wheel_voltage: wheel supply, relative.  wheel_phase: by how much its phases are not where they
    should be, rad.  pickoff_excitation, torquer_excitation: excitation currents of the pickoff, and of the torquer or
    the magnetic suspension, relative.  Fed with a voltage U into an inductive winding, a current goes with U over the
    frequency: 1e-4 more in the frequency is -1e-4 here.  wander: Gauss-Markov process, stationary from the start, held
    over an internal step.  What the gyro makes of them stands with the gyro.  [GYRO-SUPPLY]

    Not modelled: start of the wheel, hunting, common causes of the outputs (mains, room), harmonics of the wave form.
    Source: Hu 1981, section 5.8, items 2 (1) to (4), (6); the time functions are our own.
    """

    version = "1.0.0"
    simulates = (
        each("frequency_offset", ("supply.frequency",)),
        each("frequency_ramp", ("supply.frequency.drift",)),
        each("voltage_offset", ("supply.voltage",)),
        each("voltage_ramp", ("supply.voltage.drift",)),
        each("asymmetry_offset", ("supply.phase",)),
        each("asymmetry_ramp", ("supply.phase.drift",)),
        each("pickoff_offset", ("supply.pickoff",)),
        each("pickoff_ramp", ("supply.pickoff.drift",)),
        each("torquer_offset", ("supply.torquer",)),
        each("torquer_ramp", ("supply.torquer.drift",)),
    )

    frequency = Departure("wheel frequency")
    voltage = Departure("wheel voltage")
    asymmetry = Departure("asymmetry of the wheel's phases", "rad")
    pickoff = Departure("excitation of the pickoff")
    torquer = Departure("excitation of torquer or suspension")
    step_time = Parameter(0.0, "s", "time of the steps", min=0.0)
    period = Parameter(600.0, "s", "period of the ripple", above=0.0)
    phase = Parameter(0.0, "rad", "phase of the ripple at t = 0")
    tau = Parameter(300.0, "s", "correlation time of what is random", above=0.0)
    frequency_wander = GaussMarkov(0.0, "1", "wheel frequency, random part", tau="tau")
    voltage_wander = GaussMarkov(0.0, "1", "wheel voltage, random part", tau="tau")
    asymmetry_wander = GaussMarkov(0.0, "rad", "asymmetry of the wheel's phases, random part", tau="tau")
    pickoff_wander = GaussMarkov(0.0, "1", "excitation of the pickoff, random part", tau="tau")
    torquer_wander = GaussMarkov(0.0, "1", "excitation of torquer or suspension, random part", tau="tau")
    step = Parameter(1e9, "s", "largest internal step: one for each communication step", above=0.0)

    wheel_frequency = Output("1", "frequency of the wheel supply, relative departure")
    wheel_voltage = Output("1", "voltage of the wheel supply, relative departure")
    wheel_phase = Output("rad", "asymmetry of the phases of the wheel supply")
    pickoff_excitation = Output("1", "excitation current of the pickoff, relative departure")
    torquer_excitation = Output("1", "excitation of torquer or suspension, relative departure")

    def outputs(self) -> None:
        wave = sin(2.0 * pi / self.period * self.t + self.phase)
        stepped = 0.0
        if self.t >= self.step_time:
            stepped = 1.0
        self.wheel_frequency = self.frequency.now(self.t, stepped, wave) + self.frequency_wander_value
        self.wheel_voltage = self.voltage.now(self.t, stepped, wave) + self.voltage_wander_value
        self.wheel_phase = self.asymmetry.now(self.t, stepped, wave) + self.asymmetry_wander_value
        self.pickoff_excitation = self.pickoff.now(self.t, stepped, wave) + self.pickoff_wander_value
        self.torquer_excitation = self.torquer.now(self.t, stepped, wave) + self.torquer_wander_value
