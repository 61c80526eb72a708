from __future__ import annotations

from gyrobench.component import Component, Discrete, Input, Noise, Output, Parameter, State, sampled
from gyrobench.component.blocks.platform import left, moved_base
from gyrobench.component.math import Number, Vector, atan2, cross, fabs, floor, index, sqrt, vector

NONE = [0.0, 0.0, 0.0]
PAIR = [0.0, 0.0]
IMAGES = 8  # under way at most


class OpticalTracker(Component):
    """Camera and image processing on a line of sight: how far a target is from it, frame by frame.  [TRACK-IMAGE]

    The line of sight is y of the tracker.  The fixed frame of `direction` has its axes at the start; their directions
    e_k in axes of the tracker follow its rate, e' = e x omega.  With s = sum direction_k e_k the true error is

        miss = (atan2(s_z, s_y), atan2(-s_x, s_y))              about x (pitch) and z (yaw); + : the target is up, left

    Every `period` an image is exposed for `exposure`; `processing` after its end its error is there, and held:

        error = q round((mean of miss over the exposure + noise) / q),  q = pixel            0 where the target is lost

    Lost: outside of `field` in either axis at the mean, or behind; the error is 0 then.  Delay from the middle of the
    exposure: exposure/2 + processing, and period/2 more on average by the hold.

    The part is linearized by the continuous equivalent of its frames, exp(-s T) times the two averages by exposure
    and hold, T = exposure/2 + processing + period/2: poles those of Pade's [3/4] of exp(-s T), zeros such that all
    agrees up to s3.  Until the first image has arrived, the error is that of the equivalent.

    Prediction over the delay, in each axis the Kalman filter of a steady state that takes the `order`-th derivative of
    the error for a random walk, w = bandwidth, z the error that is there:

        x' = v + l1 (z - x),  v' = a + l2 (z - x),  a' = l3 (z - x)        error = x + ahead v + ahead2 a / 2

        order 1  l = (sqrt(2) w, w2, 0)        order 2  l = (2 w, 2 w2, w3)

    From z to the error that is 1 + ahead s up to s, with order 2 + ahead2 s2/2 up to s2: of the delay's own row.
    w = Lambda^(1/2) / period and Lambda^(1/3) / period with Kalata's tracking index Lambda, rms of the change of v
    (order 2: of a) from image to image over the noise of an image, both times period (order 2: period2).

    Not modelled: size and contrast of the target, optics, rotation of the image during the exposure, a rolling shutter,
    noise that depends on the motion blur, loss of single images.
    Source: equations of our own; delay of an imaging tracker in the loop: Masten 2008; filter: Kalata 1984,
    Barshalom 2001 (section 6.5), here in its limit of small indices, images without end.
    """

    version = "1.0.0"
    integrator = "rk4"
    rk4_substeps = 1

    step = Parameter(1e9, "s", "largest internal step: one for each communication step", above=0.0)
    period = Parameter(0.01, "s", "time from image to image, whole communication steps", above=0.0)
    exposure = Parameter(0.004, "s", "time of exposure, whole communication steps", min=0.0)
    processing = Parameter(0.01, "s", "from the end of the exposure to the error, whole communication steps", min=0.0)
    pixel = Parameter(0.0, "rad", "resolution of the error; 0: none", min=0.0)
    order = Parameter(0, int, "prediction: 0 none, 1 by a rate, 2 by an acceleration too", min=0, max=2)
    ahead = Parameter(0.017, "s", "prediction: time over which", min=0.0)
    bandwidth = Parameter(50.0, "rad/s", "prediction: of its filter", above=0.0)
    field = Parameter(0.02, "rad", "field of view, full angle in each axis", above=0.0, below=3.0)
    image_noise = Noise(1e-5, "rad", "noise of each image and axis, rms", per="step", samples=2)

    direction = Input([0.0, 1.0, 0.0], "1", "unit vector to the target, fixed frame")
    omega_target = Input(NONE, "rad/s", "inertial rate of that direction, fixed frame")
    alpha_target = Input(NONE, "rad/s2", "its derivative")
    omega = Input(NONE, "rad/s", "inertial rate of the tracker, its axes")
    alpha = Input(NONE, "rad/s2", "its derivative")

    error = Output("rad", "measured error, about x and z", shape=(2,))
    miss = Output("rad", "true error, about x and z", shape=(2,))
    rate = Output("rad/s", "true inertial rate of the direction, about x and z of the tracker", shape=(2,))
    acceleration = Output("rad/s2", "its derivative in the fixed frame, about the same axes", shape=(2,))
    lost = Output("1", "1 while the target is lost")
    images = Output("1", "images that have arrived")

    e1 = State([1.0, 0.0, 0.0], "1", "x of the fixed frame, axes of the tracker")
    e2 = State([0.0, 1.0, 0.0], "1", "y of it")
    lag = State([[0.0] * 4, [0.0] * 4], "rad", "continuous equivalent of the frames")

    filter = State([[0.0] * 3, [0.0] * 3], "rad", "prediction: error, its rate / bandwidth, acceleration / bandwidth2")

    row = Discrete([0.0] * 4, "1", "numerator of the equivalent, rising powers")
    T = Discrete(1.0, "s", "its delay")
    count = Discrete(0.0, "1", "communication steps")
    sum = Discrete(PAIR, "rad", "sum over the exposure")
    last = Discrete(PAIR, "rad", "true error at the step before")
    ready = Discrete([PAIR] * IMAGES, "rad", "errors of the images under way")
    gone = Discrete([0.0] * IMAGES, "1", "1: the target was lost in it")
    held = Discrete(PAIR, "rad", "error of the image that arrived last")
    out = Discrete(0.0, "1", "1: the target was lost in it")
    arrived = Discrete(0.0, "1", "images that have arrived")
    rate_before = Discrete(NONE, "rad/s", "omega at the end of the communication step before")
    rise_before = Discrete(NONE, "rad/s2", "alpha then")

    def start(self) -> None:
        self.refuse(self.exposure > self.period, "exposure = {exposure} s is longer than period = {period} s")
        self.refuse(
            self.processing > (IMAGES - 1.0) * self.period,
            "processing = {processing} s: more than 7 images of period = {period} s would be under way",
        )
        self.T = 0.5 * self.exposure + self.processing + 0.5 * self.period
        c = (self.exposure * self.exposure + self.period * self.period) / (24.0 * self.T * self.T)
        h = vector([1.0, -1.0, 0.5 + c, -1.0 / 6.0 - c])  # of exp(-x) and both averages
        d = vector([1.0, 4.0 / 7.0, 1.0 / 7.0, 2.0 / 105.0])  # Pade's denominator; + x4/840
        for k in range(4):
            self.row[k] = 0.0
            for j in range(4):
                if j <= k:
                    self.row[k] = self.row[k] + d[j] * h[index(k - j + 0.0)]
        self.count = 0.0
        self.arrived = 0.0
        self.last = self.seen(self.place())
        self.rate_before = self.omega
        self.rise_before = self.alpha

    def turned(self, v: Vector) -> Vector:
        """Return a vector of the fixed frame in axes of the tracker."""
        return vector(v[0] * self.e1 + v[1] * self.e2 + v[2] * cross(self.e1, self.e2))

    def place(self) -> Vector:
        """Return the direction of the target in axes of the tracker."""
        return self.turned(self.direction)

    def seen(self, s: Vector) -> Vector:
        return vector([atan2(s[2], s[1]), atan2(-s[0], s[1])])

    def steps(self, time: Number) -> Number:
        """Return the communication steps of a time."""
        return floor(time / self.h + 0.5)

    def odd(self, time: Number) -> Number:
        """Return 1 where a time is not whole communication steps."""
        return 1.0 if fabs(self.steps(time) * self.h - time) > 1e-6 * time + 1e-9 * self.h else 0.0

    def flow(self) -> None:
        w = vector(self.omega)
        y = left(self.t, self.step_start, self.step_end)
        if y > 0.0:
            step = self.step_end - self.step_start
            for k in range(3):
                m = moved_base(y, step, self.rate_before[k], self.rise_before[k], self.omega[k], self.alpha[k])
                w[k] = m[0]
        self.der.e1 = cross(self.e1, w)
        self.der.e2 = cross(self.e2, w)
        x = self.seen(self.place())
        for k in range(2):
            z = vector(self.lag[k])
            for j in range(3):
                self.der.lag[k][j] = z[j + 1] / self.T
            back = 840.0 * z[0] + 480.0 * z[1] + 120.0 * z[2] + 16.0 * z[3]
            self.der.lag[k][3] = (x[k] - back) / self.T
            self.predict(k)

    def predict(self, k: Number) -> None:
        """Set the derivatives of the filter of axis k; without prediction it stays 0, and leaves no pole at 0."""
        w = self.bandwidth
        z = vector(self.filter[index(k)])
        new = self.arrived_error(k) - z[0]
        self.der.filter[index(k)][0] = w * (z[1] + (sqrt(2.0) if self.order < 1.5 else 2.0) * new)
        self.der.filter[index(k)][1] = w * (z[2] + (1.0 if self.order < 1.5 else 2.0) * new)
        self.der.filter[index(k)][2] = w * (new if self.order > 1.5 else -z[2])
        if self.order < 0.5:
            for j in range(3):
                self.der.filter[index(k)][j] = -w * z[j]

    def arrived_error(self, k: Number) -> Number:
        """Return the error of the image that arrived last; until the first, of the continuous equivalent."""
        z = vector(self.lag[index(k)])
        y = self.row[0] * z[0] + self.row[1] * z[1] + self.row[2] * z[2] + self.row[3] * z[3]
        return self.held[index(k)] if self.arrived > 0.5 else 840.0 * y

    @sampled(every=1)
    def tick(self) -> None:
        if self.count == 0.0:
            few = self.steps(self.exposure) + self.steps(self.processing) < 3.0
            self.refuse(self.odd(self.period) > 0.5, "period = {period} s must be whole communication steps")
            self.refuse(self.odd(self.exposure) > 0.5, "exposure = {exposure} s must be whole communication steps")
            self.refuse(
                self.odd(self.processing) > 0.5, "processing = {processing} s must be whole communication steps"
            )
            self.refuse(few, "exposure and processing must be three communication steps or more together")
        self.count = self.count + 1.0
        n = self.steps(self.period)
        exposed = self.steps(self.exposure)
        k = floor((self.count - 1.0) / n)  # number of the image that began last, and how far it is
        into = self.count - k * n
        now = self.seen(self.place())
        if into == 1.0:
            self.sum = vector([0.0, 0.0])
        if into <= exposed:
            self.sum = self.sum + 0.5 * (now + self.last)
        if into == (exposed if exposed > 0.0 else 1.0):
            self.take(k, self.sum / exposed if exposed > 0.0 else self.last)
        self.last = now
        latest = self.count - (exposed if exposed > 0.0 else 1.0) - self.steps(self.processing)
        k = floor(latest / n)
        if latest >= 0.0 and k * n == latest:
            at = k - IMAGES * floor(k / IMAGES)
            self.held = self.ready[index(at)]
            self.out = self.gone[index(at)]
            self.arrived = k + 1.0
        if self.t >= self.step_end:
            self.rate_before = self.omega
            self.rise_before = self.alpha

    def take(self, k: Number, mean: Vector) -> None:
        """Measure image k."""
        at = k - IMAGES * floor(k / IMAGES)
        outside = 1.0 if self.place()[1] <= 0.0 else 0.0
        for j in range(2):
            if fabs(mean[j]) > 0.5 * self.field:
                outside = 1.0
        for j in range(2):
            e = mean[j] + self.noise.image_noise[j]
            if self.pixel > 0.0:
                e = self.pixel * floor(e / self.pixel + 0.5)
            self.ready[index(at)][j] = 0.0 if outside > 0.5 else e
        self.gone[index(at)] = outside

    def outputs(self) -> None:
        self.miss = self.seen(self.place())
        w = self.turned(self.omega_target)
        a = self.turned(self.alpha_target)
        self.rate[0] = w[0]
        self.rate[1] = w[2]
        self.acceleration[0] = a[0]
        self.acceleration[1] = a[2]
        self.lost = self.out
        self.images = self.arrived
        x = self.bandwidth * self.ahead
        for k in range(2):
            z = vector(self.filter[k])
            ahead = z[0] + x * (z[1] + 0.5 * x * z[2])
            self.error[k] = ahead if self.order > 0.5 else self.arrived_error(k)
