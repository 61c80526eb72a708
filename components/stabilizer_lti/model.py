from __future__ import annotations

from gyrobench.component import Component, Discrete, Input, Output, Parameter, State, sampled
from gyrobench.component.blocks.linear_controller import (
    NO_MATRIX,
    NO_POLYNOMIAL,
    NO_STATE,
    UNIT,
    N,
    companion,
    degree,
    inverse,
    mean_size,
    mean_transition,
    output_row,
)
from gyrobench.component.math import Number, clip, dot, fabs, floor, index, maximum, vector


class StabilizerLti(Component):
    """Stabilizer loop of any linear controller as data: up to eight states, continuous or sampled.  [STABILIZER-LTI]

        e = u + test                     v = -y, limited to +-v_max,  y that of  r = e - K_u command

    Ts = 0, continuous               x' = A x + B r,  y = C x + D r           G(s) = num(s) / den(s)
    Ts > 0, sampled, as given        x+ = A x + B r,  y = C x + D r           G(z) = num(1/z) / den(1/z)
    Ts > 0, of a continuous one      discretize = 1: r held between the samples, 2: s = (2/Ts) (z - 1)/(z + 1)

    form 0 takes A, B, C, D, form 1 num and den, their coefficients from the power 0 on.  A sample is taken at the ends
    of the communication steps k Ts, k = 1, 2 ...; v holds until the next.

    conditioned = 1: while v is limited, the states follow what the motor gets (Hanus), x' = A x + B r + B/D (-v - y):
    no wind-up.  It takes D other than 0, and zeros of G that are stable, which become the poles then.

    Not modelled: resolution of converters, time of computation (give it as powers of 1/z), several inputs, bandwidth
    and noise of the amplifier.
    Source: Astrom 1997, sections 2.3, 3.5 and 8.3; conditioning: Hanus 1987.
    """

    version = "1.0.0"
    nonlinear = "limiting"

    step = Parameter(1e9, "s", "largest internal step: one for each communication step", above=0.0)
    form = Parameter(0, int, "0: state space A, B, C, D; 1: transfer function num / den", min=0, max=1)
    Ts = Parameter(0.0, "s", "sampling period, a whole multiple of the communication step; 0: continuous", min=0.0)
    discretize = Parameter(0, int, "of a sampled one: 0 as given, 1 held input, 2 Tustin", min=0, max=2)
    n = Parameter(0, int, "states of the state space", min=0, max=N)
    A = Parameter(NO_MATRIX, "1", "state space (continuous: 1/s)")
    B = Parameter(NO_STATE, "1", "its input column")
    C = Parameter(NO_STATE, "1", "its output row")
    D = Parameter(1.0, "1", "its direct part")
    num = Parameter([1.0, *NO_POLYNOMIAL[1:]], "1", "numerator by rising powers of s, or of 1/z as given")
    den = Parameter([1.0, *NO_POLYNOMIAL[1:]], "1", "denominator by the same powers")
    K_u = Parameter(0.0, "V.s/rad", "gyro signal per rate, for the rate command; 0: no command", min=0.0)
    v_max = Parameter(27.0, "V", "largest voltage", above=0.0)
    conditioned = Parameter(0, int, "1: the states follow the limited voltage", min=0, max=1)

    u = Input(0.0, "V", "gyro signal")
    test = Input(0.0, "V", "test signal added to it")
    command = Input(0.0, "rad/s", "rate commanded to the platform")

    v = Output("V", "voltage of the torque motor")
    e = Output("V", "the signal inside the loop, u + test")
    saturated = Output("1", "1 while the voltage is limited")

    x = State(NO_STATE, "1", "states of a continuous controller")

    F = Discrete(NO_MATRIX, "1", "A as it is used")
    G = Discrete(NO_STATE, "1", "B as it is used")
    H = Discrete(NO_STATE, "1", "C as it is used")
    direct = Discrete(0.0, "1", "D as it is used")
    xs = Discrete(NO_STATE, "1", "states of a sampled controller")
    held = Discrete(0.0, "V", "y of the last sample; 0 before the first")
    follow = Discrete(0.0, "1", "1/D of a conditioned controller, else 0")
    limiting = Discrete(0.0, "1", "1: y is limited, or was in the step before")
    limited = Discrete(0.0, "1", "1: y is limited")
    coupling = Discrete(0.0, "s", "communication step that `every` holds for")
    every = Discrete(1.0, "1", "communication steps in a sampling period")
    due = Discrete(1.0, "1", "communication steps until the next sample")

    def start(self) -> None:
        self.refuse(self.discretize > 0.5 and self.Ts == 0.0, "discretize = {discretize} takes a period: set Ts > 0")
        if self.form < 0.5:
            self.take_state_space()
        elif self.Ts > 0.0 and self.discretize < 0.5:
            self.take_powers_of_delay()
        else:
            self.take_powers_of_s()
        if self.discretize > 0.5:
            self.sample()
        self.refuse(
            self.conditioned > 0.5 and self.direct == 0.0,
            "conditioned = 1 takes a controller with a direct part: at high frequencies G must not be 0",
        )
        self.follow = 1.0 / self.direct if self.conditioned > 0.5 else 0.0
        self.coupling = 0.0

    def take_state_space(self) -> None:
        beyond = 0.0
        for i in range(N):
            for j in range(N):
                if (i >= self.n or j >= self.n) and self.A[i][j] != 0.0:
                    beyond = 1.0
            if i >= self.n and (self.B[i] != 0.0 or self.C[i] != 0.0):
                beyond = 1.0
        self.refuse(beyond > 0.5, "A, B or C has numbers beyond n = {n} states: set them to 0, or n higher")
        self.F = vector(self.A)
        self.G = vector(self.B)
        self.H = vector(self.C)
        self.direct = self.D
        for i in range(N):
            if i >= self.n and (self.Ts == 0.0 or self.discretize > 0.5):
                self.F[i][i] = -1.0  # stays 0, and leaves no pole at 0 in the linearization

    def take_powers_of_s(self) -> None:
        order = degree(self.den)
        self.refuse(self.den[index(order)] == 0.0, "den is 0 in every coefficient")
        self.refuse(
            degree(self.num) > order,
            "num has a higher power of s than den: a controller must not differentiate; give it one more pole",
        )
        w = mean_size(self.den, order)
        self.F = companion(self.den, order, w)
        self.G = vector(NO_STATE)
        if order > 0.5:
            self.G[index(order - 1.0)] = w
        self.H = output_row(self.num, self.den, order, w)
        self.direct = self.num[index(order)] / self.den[index(order)]
        for i in range(N):
            if i >= order:
                self.F[i][i] = -1.0

    def take_powers_of_delay(self) -> None:
        self.refuse(self.den[0] == 0.0, "den[1], the power 0 of 1/z, is 0: y would need values to come")
        order = maximum(degree(self.num), degree(self.den))
        self.F = vector(NO_MATRIX)
        self.G = vector(NO_STATE)
        self.H = vector(NO_STATE)
        self.direct = self.num[0] / self.den[0]
        for i in range(N):
            if i < order:
                self.F[i][0] = -self.den[i + 1] / self.den[0]
                self.G[i] = (self.num[i + 1] - self.direct * self.den[i + 1]) / self.den[0]
        for i in range(N - 1):
            if i + 1 < order:
                self.F[i][i + 1] = 1.0
        if order > 0.5:
            self.H[0] = 1.0

    def sample(self) -> None:
        """Make F, G, H and direct those of the sampled controller."""
        if self.discretize < 1.5:
            mean = mean_transition(self.F, self.Ts)
            self.G = mean @ self.G * self.Ts
            self.F = vector(UNIT) + self.F @ mean * self.Ts
        else:
            half = self.F * (0.5 * self.Ts)
            turned = inverse(vector(UNIT) - half)
            size = 0.0
            for i in range(N):
                for j in range(N):
                    size = maximum(size, fabs(turned[i][j]))
            self.refuse(size == 0.0, "the controller has a pole at 2/Ts: Tustin's formula has no value there")
            g = turned @ self.G
            self.direct = self.direct + dot(self.H, g) * (0.5 * self.Ts)
            self.F = turned @ (vector(UNIT) + half)
            self.H = self.H @ turned
            self.G = g * self.Ts

    def error(self) -> Number:
        return self.u + self.test - self.K_u * self.command

    def now(self) -> Number:
        """Return y before its limit."""
        return dot(self.H, self.x) + self.direct * self.error()

    def flow(self) -> None:
        if self.Ts == 0.0:
            y = self.now()
            drive = self.error() + self.follow * (clip(y, -self.v_max, self.v_max) - y)
            self.der.x = self.F @ self.x + self.G * drive
        else:
            self.der.x = self.x * -1.0

    @sampled(every=1)
    def tick(self) -> None:
        if self.Ts > 0.0:
            if fabs(self.h - self.coupling) > 1e-9 * self.h:
                self.coupling = self.h
                self.every = floor(self.Ts / self.h + 0.5)
                self.due = self.every
                self.refuse(
                    self.every < 0.5 or fabs(self.every * self.h - self.Ts) > 1e-6 * self.Ts,
                    "Ts = {Ts} s must be a whole multiple of the communication step, {coupling} s",
                )
            self.due = self.due - 1.0
            if self.due < 0.5:
                self.due = self.every
                r = self.error()
                self.held = dot(self.H, self.xs) + self.direct * r
                drive = r + self.follow * (clip(self.held, -self.v_max, self.v_max) - self.held)
                self.xs = self.F @ self.xs + self.G * drive
        elif self.follow != 0.0:
            before = self.limited
            self.limited = 1.0 if fabs(self.now()) > self.v_max else 0.0
            self.limiting = maximum(before, self.limited)

    def outputs(self) -> None:
        self.e = self.u + self.test
        y = self.held if self.Ts > 0.0 else self.now()
        self.v = -clip(y, -self.v_max, self.v_max)
        self.saturated = 1.0 if fabs(y) > self.v_max else 0.0
