"""Random drift by the coefficients of its Allan deviation: B (flicker), K (rate random walk), Q (quantization).

White noise (N) is a Noise port, the rate ramp (R) a parameter.  PSDs are two-sided, S(f) for f of both signs, and the
Allan variances are those of means over tau, as in IEEE 952, annex C:

    N   S = N2                        N2 / tau              K   S = K2 / (2 pi f)2            K2 tau / 3
    B   S = B2 / (2 pi |f|)           2 ln 2 B2 / pi        R   (no PSD)                      R2 tau2 / 2
    Q   S = (2 pi f)2 S_angle         3 Q2 / tau2

All processes are exact at the ends of the internal steps, whatever their length, and are held over the next one.  A
process of size 0 draws nothing and is not stepped.
"""

from __future__ import annotations

from gyrobench.component.composition import Block, sampled
from gyrobench.component.declarations import Discrete, Noise, Parameter
from gyrobench.component.math import exp, floor, sqrt

RELAXATIONS = 12
RATIO = 4.0  # of neighbouring correlation times
HELD = 16.0  # part of its correlation time for which a relaxation is held
FINEST = HELD * RATIO ** (RELAXATIONS - 1)
#: standard deviation of one relaxation over B: (ln(RATIO) / pi) ** 0.5; of the first and the last, which stand for
#: those beyond them too, (RATIO / (RATIO - 1)) ** 0.5 times as much
INNER = 0.6642824702679601
OUTER = 0.7670473260543126


class Flicker(Block):
    """Flicker noise (bias instability): 12 independent Gauss-Markov processes, stationary from the start.

        x_j+ = a x_j + sqrt(1 - a2) B xi_j,   a = e^(-n/16),   tau_j = tau / 4^(11 - j),   j = 0 .. 11
        value = INNER (x_0 + ... + x_11) + (OUTER - INNER) (x_0 + x_11)

    where n multiples of tau_j / 16 have passed in the internal step: each process is exact at them and held between,
    so that a step that is short beside the correlation times draws few numbers.  What is held keeps the PSD of the
    process but for narrow dips at 16 / tau_j and its multiples.
    Its PSD is B2 / (2 pi f) within 1 % (0.3 % the ripple of the bank, in the dips 1.3 %) from f = 0.46 / tau to
    0.055 / tau_0, 5.7 decades, and flat below: the variance is finite, 5.59 B2, and the value at the start belongs to
    it.  Keep the internal step below tau_0: beyond it the faster processes fold into the band (0.1 s: 3 % too much at
    0.1 Hz, 27 % at 1 Hz).
    Not modelled: flicker that goes on below 0.46 / tau; no process in nature is known to end there.
    Source: IEEE 952, annex C.  Of a bank without ends, x = ln(2 pi f tau_0), the PSD is B2 / (2 pi f) times
    1 + 2 sum of cos(2 pi k x / L) / cosh(pi2 k / L) over k >= 1, L = ln 4: ripple 2 / cosh(7.12) = 0.3 %.
    """

    suffixes = {"B": ""}
    B = Noise(0.0, "1", "flicker noise, coefficient B", per="use", samples=RELAXATIONS)
    tau = Parameter(1e5, "s", "longest correlation time of the flicker noise", above=0.0)
    relaxation = Discrete([0.0] * RELAXATIONS, "1", "relaxations of the flicker noise, fastest first")
    value = Discrete(0.0, "1", "flicker noise")
    passed = Discrete(0.0, "1", "multiples of a sixteenth of the shortest correlation time since t = 0")

    def __init__(self, unit: str, what: str, tau: str = "") -> None:
        """what: "drift, x channel"; tau: the name of a parameter that is shared."""
        size = Noise(0.0, unit, f"flicker {what}, coefficient B", per="use", samples=RELAXATIONS)
        longest = tau or Parameter(1e5, "s", f"longest correlation time of the flicker {what}", above=0.0)
        relaxations = Discrete([0.0] * RELAXATIONS, unit, f"relaxations of the flicker {what}, fastest first")
        super().__init__(B=size, tau=longest, relaxation=relaxations, value=Discrete(0.0, unit, f"flicker {what}"))

    def start(self) -> None:
        for j in range(RELAXATIONS):
            self.relaxation[j] = self.noise.B[j]
        self.passed = floor(self.t * FINEST / self.tau)
        self.add_up()

    @sampled(every=1)
    def tick(self) -> None:
        if self.B > 0.0:
            before = self.passed
            now = floor(self.t * FINEST / self.tau)
            if now > before:
                self.passed = now
                for j in range(RELAXATIONS):
                    if now > before:  # multiples of the slower ones are those of the faster ones, too
                        a = exp((before - now) / HELD)
                        self.relaxation[j] = a * self.relaxation[j] + sqrt(1.0 - a * a) * self.noise.B[j]
                        before = floor(before / RATIO)
                        now = floor(now / RATIO)
                self.add_up()

    def add_up(self) -> None:
        total = 0.0
        for j in range(RELAXATIONS):
            total = total + self.relaxation[j]
        self.value = INNER * total + (OUTER - INNER) * (self.relaxation[0] + self.relaxation[RELAXATIONS - 1])


class RateRandomWalk(Block):
    """Rate random walk: value+ = value + K sqrt(h) xi, 0 at the start.  [DRIFT-RANDOM-CLASSES]"""

    suffixes = {"K": ""}
    K = Noise(0.0, "1", "random walk, coefficient K")
    value = Discrete(0.0, "1", "random walk")

    def __init__(self, unit: str, per_root_second: str, what: str) -> None:
        """unit of the value, unit of K (unit/s/sqrt(Hz)); what: "drift, x channel"."""
        size = Noise(0.0, per_root_second, f"random walk of the {what}, coefficient K")
        super().__init__(K=size, value=Discrete(0.0, unit, f"random walk of the {what}"))

    def start(self) -> None:
        self.value = 0.0

    @sampled(every=1)
    def tick(self) -> None:
        if self.K > 0.0:
            self.value = self.value + self.h * self.noise.K


class Quantization(Block):
    """Angle noise as it is left by reading an angle in steps, seen in the rate: coefficient Q.

        e+ = a e + sqrt(1 - a2) Q xi,   a = e^(-h/tau),   rate = (e+ - e) / h

    A mean of the rate over T errs by the difference of two errors e over T: Allan variance Q2 (3 - 4 r + r2) / T2 with
    r = e^(-T/tau), which is 3 Q2 / T2 for T above 5 tau; PSD of the angle 2 Q2 tau / (1 + (2 pi f tau)2).  Steps of
    size d leave Q = d / sqrt(12) where the angle goes through several of them between readings.
    The rate is that of one internal step later (e+ is drawn ahead), and 0 in the first step.
    Not modelled: the steps themselves (parts that read in steps have a `resolution`).
    Source: IEEE 952, annex C.
    """

    suffixes = {"Q": ""}
    Q = Noise(0.0, "rad", "angle noise, coefficient Q (rms)", per="step")
    tau = Parameter(0.1, "s", "its correlation time", above=0.0)
    error = Discrete(0.0, "rad", "angle noise")
    rate = Discrete(0.0, "rad/s", "its derivative, mean over an internal step")

    def __init__(self, what: str, tau: str = "") -> None:
        """what: "drift, x channel"; tau: the name of a parameter that is shared."""
        size = Noise(0.0, "rad", f"angle noise of the {what}, coefficient Q (rms)", per="step")
        own = Parameter(0.1, "s", f"correlation time of the angle noise of the {what}", above=0.0)
        super().__init__(Q=size, tau=tau or own)

    def start(self) -> None:
        self.error = self.noise.Q
        self.rate = 0.0

    @sampled(every=1)
    def tick(self) -> None:
        if self.Q > 0.0:
            a = exp(-self.h / self.tau)
            later = a * self.error + sqrt(1.0 - a * a) * self.noise.Q
            self.rate = (later - self.error) / self.h
            self.error = later
