"""Sources of error that are this test's own."""

from gyrobench.reduction.setup.sources import Source

DRIFT_RATE = Source("gyro.drift_rate", "drift rate of the gyro", "rad/s", "u_drift")
