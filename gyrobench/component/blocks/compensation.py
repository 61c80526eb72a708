"""Compensation of drift: a linear model of three states between two readings."""

from __future__ import annotations

from gyrobench.component.composition import Block
from gyrobench.component.declarations import Discrete
from gyrobench.component.math import Number, Vector, fabs, maximum, vector

ZEROS = [0.0, 0.0, 0.0]
SQUARE = [ZEROS, ZEROS, ZEROS]
UNIT = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]
TERMS = 24  # of the series; the last one is below 1e-19 of the first
HALVINGS = 40  # of a step, at most


class SampledModel(Block):
    """x' = F x + b u + w over a step h in which u is held: x+ = Phi x + B u + w_d, cov w_d = Q; w white, density L.

        Phi = exp(F h)     B = integral of exp(F s) b     Q = integral of exp(F s) L exp(F s)'      (s from 0 to h)

    All three by their series over a part h/2^n of the step, then doubled n times: Phi <- Phi Phi, B <- B + Phi B,
    Q <- Q + Phi Q Phi'.  The integrals of Van Loan without his exponential of -F, which overflows for fast lags.
    """

    Phi = Discrete(UNIT, "1", "transition of the states over a step")
    Q = Discrete(SQUARE, "1", "covariance that the noise adds in a step")
    B = Discrete(ZEROS, "1", "change of the states by the input held over a step")

    def make(self, F: Vector, L: Vector, b: Vector, h: Number) -> None:
        """Set Phi, Q and B for the step h."""
        fastest = maximum(fabs(F[0][0]), maximum(fabs(F[1][1]), fabs(F[2][2]))) * h
        part = h
        doublings = 0.0
        for n in range(HALVINGS):
            if fastest > 0.5:
                fastest = 0.5 * fastest
                part = 0.5 * part
                doublings = n + 1.0
        power = vector(UNIT)  # F^n part^n / n!
        held = b * part  # F^n b part^(n+1) / (n+1)!
        spread = L * part  # of the series Q' = F Q + Q F' + L
        self.Phi = vector(UNIT)
        self.B = held
        self.Q = spread
        for n in range(TERMS):
            power = (F @ power) * (part / (n + 1.0))
            held = (F @ held) * (part / (n + 2.0))
            grown = F @ spread
            spread = (grown + grown.T) * (part / (n + 2.0))
            self.Phi = self.Phi + power
            self.B = self.B + held
            self.Q = self.Q + spread
        for n in range(HALVINGS):
            if n < doublings:
                self.B = self.B + self.Phi @ self.B
                self.Q = self.Q + self.Phi @ self.Q @ self.Phi.T
                self.Phi = self.Phi @ self.Phi
