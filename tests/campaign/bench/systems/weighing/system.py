"""The mean of noisy readings: a test of milliseconds with a known truth, and with every fault a run can have."""

from gyrobench.record.record import Record
from gyrobench.record.run_document import RunDocument
from gyrobench.system.sockets import Socket
from gyrobench.system.system import MeasuredData, Option, Slot, System


def read(system, data, values):
    """A file with a number a line."""
    import numpy as np

    try:
        numbers = np.array([float(line) for line in data.read_text().split()])
    except ValueError as error:
        from gyrobench.record.csv_reader import DataError

        raise DataError(data, [str(error)]) from None
    run = RunDocument(system="weighing", measured=True, instrument=data.stem, date="2026-03-14", options={})
    return Record({}, {"time": np.arange(numbers.size) * 1.0, "source.z": numbers}, run)


class Weighing(System):
    """Readings of a constant under white noise."""

    title = "Mean of readings"
    slots = {"source": Slot(Socket("Any", "whatever the part has", ()), "signal_source")}
    options = {
        "duration": Option(1.0, "s", "simulated time", 0.01, 1e6),
        "temperature": Option(300.0, "K", "changes nothing"),
        "fault": Option("", str, "what happens at the end"),
        "times": Option("", str, "file that is made longer by each run"),
    }
    channels = ("source.z",)
    channel_period = 0.01
    step = 0.01
    noises = ("source.white",)
    reduction = "reduction"
    measured_data = MeasuredData("reading", read)

    @property
    def stop(self):
        return self["duration"]

    def parameters(self, parts):
        return {"source.w": 0.0, "source.white": 0.1}

    def check(self):
        return ["fault = refused: no"] if self["fault"] == "refused" else []
