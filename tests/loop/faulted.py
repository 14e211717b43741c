# SPDX-License-Identifier: Apache-2.0
"""One fault of the plant at one operating point: when the firmware reports it, and the torque error until then."""

import math
from dataclasses import dataclass

import numpy as np

from fluxtrue_tools import faults
from fluxtrue_tools.sim.library import Loop
from fluxtrue_tools.sim.motor import Motor

RPM = math.pi / 30.0


def allowed_Nm(torque_Nm: float) -> float:
    """The torque error that needs no reaction."""
    return max(10.0, 0.05 * abs(torque_Nm))


@dataclass(frozen=True)
class Outcome:
    """Times in milliseconds; NaN: never."""

    found_ms: float  # from the fault of the plant to the fault that the firmware reports
    moved_ms: float  # from the first torque error beyond the allowed one to the reported fault
    error_ms: float  # time in which the torque error was beyond the allowed one until then
    largest_Nm: float
    lasting_Nm: float  # mean of the torque error over the last tenth of a second, if nothing was found
    names: tuple[str, ...]


def outcome(torque: np.ndarray, words: np.ndarray, before_Nm: float, period_ms: float) -> Outcome:
    """Evaluate the recorded periods after the fault."""
    found = int(np.argmax(words > 0)) if words[-1] > 0 else None
    error = torque[:found] - before_Nm
    beyond = np.abs(error) > allowed_Nm(before_Nm)
    first = int(np.argmax(beyond)) if beyond.any() else found
    last = error[-round(100.0 / period_ms) :]
    return Outcome(
        found_ms=math.nan if found is None else found * period_ms,
        moved_ms=math.nan if found is None or first is None else (found - first) * period_ms,
        error_ms=float(beyond.sum()) * period_ms,
        largest_Nm=float(np.abs(error).max(initial=0.0)),
        lasting_Nm=float(last.mean()) if len(last) else 0.0,
        names=() if found is None else tuple(faults.named(int(words[found]))),
    )


def inject(
    motor: Motor, rpm: float, torque_Nm: float, fault: dict[str, float], seconds: float, **plant: float
) -> Outcome:
    """Inject `fault` in steady state at an imposed speed; `plant` are parameters of the plant from the start."""
    return inject_slowly(motor, rpm, torque_Nm, fault, 0.0, seconds, **plant)


def inject_slowly(
    motor: Motor, rpm: float, torque_Nm: float, fault: dict[str, float], drift_s: float, seconds: float, **plant: float
) -> Outcome:
    """inject(), but each value of `fault` takes this time to change linearly."""
    parameters = motor.plant | {"imposed_speed": 1.0, "speed_rad_s": rpm * RPM} | plant
    with Loop(motor.library, parameters, motor.flux_map) as loop:
        loop.record(("truth.torque_mean_Nm", "fault_word"))
        loop.set("enable", 1.0)
        loop.run_s(0.03)
        loop.run(round(0.05 / loop.period_s), {"torque_requested_Nm": (0.0, torque_Nm)})
        healthy = loop.run_s(0.08)
        assert healthy[-1, 1] == 0.0, "a fault before the fault"
        drift = {f"plant.{name}": (loop.get(f"plant.{name}"), value) for name, value in fault.items()}
        drifting = loop.run(round(drift_s / loop.period_s), drift) if drift_s else healthy[:0]
        for name, value in fault.items():
            loop.set(f"plant.{name}", value)
        rows = np.vstack([drifting, loop.run_s(seconds)])
        before = float(healthy[-len(healthy) // 2 :, 0].mean())
        return outcome(rows[:, 0], rows[:, 1], before, 1000.0 * loop.period_s)
