"""Controller, actuator, plant and sensor in a loop: the four trivial parts that masters are timed with."""

from gyrobench.system.sockets import Socket
from gyrobench.system.system import Option, Slot, System

ANY = Socket("Any", "whatever the part has", ())


class Loop(System):
    """PI controller -> actuator lag -> damped plant -> sensor lag -> back."""

    title = "Four trivial parts in a loop"
    slots = {n: Slot(ANY, n) for n in ("controller", "actuator", "plant", "sensor")}
    wires = """
        controller.u -> actuator.u
        actuator.force -> plant.force
        plant.position -> sensor.x
        sensor.y -> controller.y
    """
    options = {"duration": Option(1.0, "s", "simulated time", 0.0)}
    channels = ("plant.position", "controller.u")
    channel_period = 0.01

    @property
    def stop(self):
        return self["duration"]
