"""Reads and simulates Modelica texts with rumoca: cases as JSON on standard input, series as JSON on standard output."""

import json
import sys

import rumoca


def simulated(case):
    model = rumoca.Session().loads(case["text"])
    if case["rows"] == 0:
        return {}
    config = rumoca.SimConfig(solver="rk-like", rtol=1e-10, atol=1e-11)
    step = case["step"]
    result = model.simulate(t=(0, step * (case["rows"] - 1)), dt=step, config=config)
    # At an event there are two samples: the last one holds from there on.
    rows = {round(time / step): k for k, time in enumerate(result.time) if abs(time / step - round(time / step)) < 1e-9}
    return {name: [float(result[name][rows[k]]) for k in range(case["rows"])] for name in result.names}


def tried(case):
    try:
        return {"series": simulated(case)}
    except rumoca.RumocaError as error:
        return {"refused": str(error)}


json.dump([tried(case) for case in json.load(sys.stdin)], sys.stdout)
