from __future__ import annotations

from gyrobench.component import Discrete, Input, Noise, Output, Parameter, State
from gyrobench.component.blocks.surroundings import RoomAndField
from gyrobench.component.math import Number, clip, vector

STAGES = 3


class Thermostat(RoomAndField):
    """Surroundings of an instrument in one to three shells, each with its heater; fits the socket Surroundings.

    Shell k, 3 the innermost, the only one of a single stage, loses heat to the one outside, the outermost to the room,
    and is held at its set point:

        C_k T_k' = G_k (T_(k-1) - T_k) - G_(k+1) (T_k - T_(k+1)) + P_k          [THERMOSTAT]
        P_k = clip(P_0k + K_p e + K_i q, 0, P_max)     q' = e     e = set_k - (T_k + sensor error + noise)

    q stands still while the heater is at a limit and e pushes further.  P_0 is what holds the set points in the room of
    the start.  The instrument follows the innermost shell with the time constant tau:  tau T' = T_3 - T.  All
    temperatures are above that of the instrument's coefficients, the room too: `offset` is below 0.

    A room that changes slowly gets through a stage by s G/(C s2 + (G + K_p) s + K_i), a ramp r by -G r/K_i.

    Not modelled: heat of the rotor (it is in the set point), several time constants of a shell, heat that goes round a
    shell by leads, cooling.
    Source: Hu 1981, section 5.8, item 2 (5); GSP ch. 5, section 5.2.1; the control law is our own.
    """

    version = "1.1.0"

    offset = Parameter(-45.0, "K", "room at the start, above the temperature of the coefficients")
    step = Parameter(1e9, "s", "largest internal step: one for each communication step", above=0.0)
    stages = Parameter(2, int, "shells with a heater", min=1, max=STAGES)
    set_point = Parameter([-20.0, -10.0, 0.0], "K", "set points, the innermost last")
    capacity = Parameter([2000.0, 1000.0, 500.0], "J/K", "heat capacities", above=0.0)
    conductance = Parameter([4.0, 2.0, 1.0], "W/K", "conductances to the shell outside", above=0.0)
    K_p = Parameter([50.0, 50.0, 50.0], "W/K", "proportional gains", min=0.0)
    K_i = Parameter([0.5, 0.5, 0.5], "W/s/K", "integral gains", min=0.0)
    power = Parameter([150.0, 100.0, 60.0], "W", "largest power of the heaters", above=0.0)
    sensor_error = Parameter([0.0, 0.0, 0.0], "K", "sensor of a shell reads so much too much")
    sensor_ramp = Parameter([0.0, 0.0, 0.0], "K/s", "its drift")
    sensor_1 = Noise(0.0, "K/sqrt(Hz)", "noise density of the sensor of shell 1")
    sensor_2 = Noise(0.0, "K/sqrt(Hz)", "noise density of the sensor of shell 2")
    sensor_3 = Noise(0.0, "K/sqrt(Hz)", "noise density of the sensor of shell 3")
    tau = Parameter(300.0, "s", "time constant of the instrument against the innermost shell", above=0.0)
    cold = Parameter(False, bool, "1: all begins at the temperature of the room, 0: at the set points")

    on = Input(1.0, "1", "0: the heaters are off, and their integrals stand still")

    heat = Output("W", "power of the heaters", shape=(STAGES,))
    shell = Output("K", "temperatures of the shells above that of the coefficients", shape=(STAGES,))
    limited = Output("1", "1 while a heater is at a limit")

    T = State([0.0, 0.0, 0.0], "K", "temperatures of the shells")
    q = State([0.0, 0.0, 0.0], "K.s", "integrals of their errors")
    held = State(0.0, "K", "temperature of the instrument")

    hold = Discrete([0.0, 0.0, 0.0], "W", "powers that hold the set points in the room of the start")
    first = Discrete(0.0, "1", "index of the outermost shell in use")

    def around(self) -> Number:
        return self.T[2]

    def inside(self) -> Number:
        return self.held

    def start(self) -> None:
        room = self.room_now()
        self.first = STAGES - self.stages
        outside = room
        for k in range(STAGES):
            self.T[k] = self.set_point[k]
            if self.cold:
                self.T[k] = room
            self.q[k] = 0.0
            self.hold[k] = 0.0
            if k >= self.first:
                self.hold[k] = self.conductance[k] * (self.set_point[k] - outside)
                outside = self.set_point[k]
        for k in range(STAGES - 1):
            if k >= self.first:
                self.hold[k] = self.hold[k] - self.conductance[k + 1] * (self.set_point[k + 1] - self.set_point[k])
        for k in range(STAGES):
            if k >= self.first:
                self.refuse(
                    self.hold[k] <= 0.0 or self.hold[k] >= self.power[k],
                    "a heater would have to cool, or to give more than its power, to hold the set points in this room: "
                    "they rise from the room to the innermost, each step of heat at least that of the next",
                )
        self.held = self.T[2]

    def errors(self) -> Number:
        """Return what the sensors say the shells are below their set points."""
        wrong = vector(self.sensor_error) + self.t * vector(self.sensor_ramp)
        noisy = vector([self.noise.sensor_1, self.noise.sensor_2, self.noise.sensor_3])
        return vector(self.set_point) - vector(self.T) - wrong - noisy

    def wanted(self) -> Number:
        """Return the powers that the controllers ask for."""
        asked = vector(self.hold)
        e = self.errors()
        for k in range(STAGES):
            asked[k] = asked[k] + self.K_p[k] * e[k] + self.K_i[k] * self.q[k]
            if self.on == 0.0:
                asked[k] = 0.0
        return vector(asked)

    def flow(self) -> None:
        e = self.errors()
        asked = self.wanted()
        into = vector([0.0, 0.0, 0.0])  # heat from the shell outside
        outside = self.room_now()
        for k in range(STAGES):
            if k >= self.first:
                into[k] = self.conductance[k] * (outside - self.T[k])
                outside = self.T[k]
        gained = vector(into)
        for k in range(STAGES - 1):
            gained[k] = gained[k] - into[k + 1]
        for k in range(STAGES):
            self.der.T[k] = 0.0
            self.der.q[k] = 0.0
            if k >= self.first:
                self.der.T[k] = (clip(asked[k], 0.0, self.power[k]) + gained[k]) / self.capacity[k]
                self.der.q[k] = e[k]
                if (asked[k] > self.power[k] and e[k] > 0.0) or (asked[k] < 0.0 and e[k] < 0.0):
                    self.der.q[k] = 0.0
                if self.on == 0.0:
                    self.der.q[k] = 0.0
        self.der.held = (self.T[2] - self.held) / self.tau

    def outputs(self) -> None:
        asked = self.wanted()
        self.limited = 0.0
        for k in range(STAGES):
            self.heat[k] = 0.0
            self.shell[k] = 0.0
            if k >= self.first:
                self.heat[k] = clip(asked[k], 0.0, self.power[k])
                self.shell[k] = self.T[k]
                if self.heat[k] != asked[k]:
                    self.limited = 1.0
