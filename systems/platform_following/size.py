"""Size of a vector that is measured with noise: u and 95 % interval, for sizes that are no more than the noise, too.

|x|2/s2 of x = m + noise is a noncentral chi-square of |m|2/s2, exactly for noise alike in all directions.  s: the noise
along x, which counts where |m| is large; degrees of freedom: trace of the covariance over s2, which gives |x|2 its mean
where m is 0.  The interval has the |m| for which |x| lies between the 2.5 and the 97.5 % point, and |x| -+ 1.96 u:
where the noise differs by direction either alone is too short (0.90, counted).  [own derivation]
"""

from __future__ import annotations

import math

import numpy as np
from scipy import optimize, special

from gyrobench.arrays import Array
from gyrobench.reduction.estimation.uncertainty import NORMAL

CLEAR = 50.0  # of u: the size of a longer one is normal


def size_of(x: Array, cov: Array) -> tuple[float, tuple[float, float]]:
    """Return u of |x| and a 95 % interval of the true size, in the unit of x; x (k,), cov (k, k)."""
    size = float(np.linalg.norm(x))
    along = x / size if size > 0.0 else np.zeros(x.size)
    u = math.sqrt(float(along @ cov @ along)) if size > 0.0 else math.sqrt(float(np.max(np.diag(cov))))
    if size >= CLEAR * u or u == 0.0:
        return u, (size - NORMAL * u, size + NORMAL * u)
    q, df = (size / u) ** 2, float(np.trace(cov)) / u**2
    top = (size / u + math.sqrt(df) + 6.0) ** 2

    def end(p: float) -> float:
        """Return the true size of which |x| is the p point; 0 where no true size is as small."""
        if special.chndtr(q, df, 0.0) <= p:
            return 0.0
        return u * math.sqrt(optimize.brentq(lambda m: special.chndtr(q, df, m) - p, 0.0, top))

    return u, (max(0.0, min(end(0.975), size - NORMAL * u)), max(end(0.025), size + NORMAL * u))
