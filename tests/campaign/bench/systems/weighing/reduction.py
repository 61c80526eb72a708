import ctypes
import math
import os
import time

from gyrobench.errors import GyrobenchError
from gyrobench.result import Coefficient, LoopResult, Reason


def from_record(record):
    z = record.channels["source.z"]
    options = record.run.options
    if options.get("times"):
        with open(options["times"], "a") as file:
            file.write(f"{record.run.seed}\n")
    match options.get("fault"):
        case "crash":
            ctypes.string_at(0)
        case "exit":
            os._exit(3)
        case "hang":
            time.sleep(3600)
        case "memory":
            held = []
            while True:
                held.append(bytearray(20_000_000))
                time.sleep(0.005)
        case "failed":
            raise GyrobenchError("the scale has no plate")
        case "error":
            raise ZeroDivisionError("by nothing")
        case "disk":
            raise OSError(28, "No space left on device")
        case "wait" if record.run.seed > 100:
            while not os.path.exists(options["times"] + ".go"):
                time.sleep(0.05)
        case "once":  # the first time only
            file = options["times"] + ".once"
            if not os.path.exists(file):
                open(file, "w").close()
                os._exit(3)
    mean, u = float(z.mean()), 0.1 / math.sqrt(z.size)
    truth = record.run.parameters.get("source.offset")
    return LoopResult(
        method="mean",
        sources=[],
        conventions=[],
        coefficients=[Coefficient("mean", "mean", "V", mean, u, 1.96, (mean - 1.96 * u, mean + 1.96 * u), truth=truth)],
        responses=[],
        reasons=[Reason("cold", "cold")] if options.get("temperature", 300.0) < 273.15 else [],
    )
