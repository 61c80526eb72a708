from __future__ import annotations

from gyrobench.component import Component, Input, Output, Parameter, State, sampled
from gyrobench.component.blocks.axis_body import Presliding
from gyrobench.component.math import Number, clip


class Contact(Presliding):
    """Presliding whose Coulomb torque has a name of its own."""

    suffixes = {}


class StabilizerObserver(Component):
    """Stabilizer loop of PI with disturbance observer and friction compensation.  [STABILIZER-OBSERVER]

        e = u + test        r = e - K_u command        y = gain (r + s),  s' = integral r
        v = -y + R/k_t (F - d),  limited to +-v_max

    Observer of the torque d that disturbs, from the measured rate m = e/K_u and the motor current i, with two poles at
    -w_o, w_o = observer:

        J w' = k_t i - F + d + 2 J w_o (m - w)         d' = J w_o2 (m - w)

    F = share k z is the torque of a model of the friction (LuGre, block Presliding) that the joint angle drives: it is
    given to the motor ahead of any error, before the platform slides, at reversals and at break-away; what it lacks is
    left to the observer.  While v is limited and r pushes further, the integral waits; the observer has the current
    that really flows.

    Takes a rate signal, the motor current, and for the friction the joint angle.
    Not modelled: back EMF in the compensation, inductance, noise and lag of the readings, a reducer (k_t is the torque
    on the platform per current).
    Source: Ohnishi 1996 (observer), Canudas 1995, eq. 1 to 4 and section VI (friction); [FRICTION-PRESLIDING].
    """

    version = "1.0.0"

    contact = Contact()

    gain = Parameter(10.0, "1", "gain of the PI, voltage per voltage; 0: the loop is open", min=0.0)
    integral = Parameter(0.0, "1/s", "corner of the integral part; 0: none", min=0.0)
    observer = Parameter(10.0, "rad/s", "both poles of the observer; 0: none", min=0.0)
    J = Parameter(2.0, "kg.m2", "inertia that the observer believes", above=0.0)
    k_t = Parameter(1.0, "N.m/A", "torque per current that it believes", above=0.0)
    R = Parameter(2.0, "Ohm", "resistance of the motor that it believes", above=0.0)
    share = Parameter(1.0, "1", "share of the friction's model that is compensated", min=0.0, max=1.0)
    K_u = Parameter(1.0, "V.s/rad", "gyro signal per rate", above=0.0)
    v_max = Parameter(27.0, "V", "largest voltage", above=0.0)

    u = Input(0.0, "V", "gyro signal, a rate")
    test = Input(0.0, "V", "test signal added to it")
    command = Input(0.0, "rad/s", "rate commanded to the platform")
    i_motor = Input(0.0, "A", "motor current")
    theta = Input(0.0, "rad", "joint angle, for the friction")

    v = Output("V", "voltage of the torque motor")
    e = Output("V", "the signal inside the loop, u + test")
    disturbance = Output("N.m", "torque that the observer finds")
    compensated = Output("N.m", "torque given against the friction")
    saturated = Output("1", "1 while the voltage is limited")

    s = State(0.0, "V", "integral part")
    w = State(0.0, "rad/s", "rate of the observer")
    d = State(0.0, "N.m", "torque of the observer")

    def start(self) -> None:
        self.contact.rest(self.theta, 0.0)

    def error(self) -> Number:
        return self.u + self.test - self.K_u * self.command

    def ahead(self) -> Number:
        """Return F, N.m."""
        return self.share * self.contact.spring * self.contact.z

    def unlimited(self) -> Number:
        return -self.gain * (self.error() + self.s) + self.R / self.k_t * (self.ahead() - self.d)

    def flow(self) -> None:
        r = self.error()
        v = self.unlimited()
        self.der.s = self.integral * r
        if (v > self.v_max and r < 0.0) or (v < -self.v_max and r > 0.0):
            self.der.s = 0.0
        if self.integral == 0.0:
            self.der.s = -self.s  # stays 0, and leaves no pole at 0 in the linearization
        short = (self.u + self.test) / self.K_u - self.w
        self.der.w = (self.k_t * self.i_motor - self.ahead() + self.d) / self.J + 2.0 * self.observer * short
        self.der.d = self.J * self.observer * self.observer * short
        if self.observer == 0.0:
            self.der.w = -self.w
            self.der.d = -self.d

    @sampled(every=1)
    def tick(self) -> None:
        self.contact.follow(self.theta)

    def outputs(self) -> None:
        self.e = self.u + self.test
        self.disturbance = self.d
        self.compensated = self.ahead()
        volts = self.unlimited()
        self.v = clip(volts, -self.v_max, self.v_max)
        self.saturated = 1.0 if self.v != volts else 0.0
