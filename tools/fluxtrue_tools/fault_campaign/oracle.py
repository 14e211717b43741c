# SPDX-License-Identifier: Apache-2.0
"""What the three safe states themselves would have given: the reference where no drive could meet the plain limits.

A shorted machine brakes, and its first current is larger than its steady one; a machine that feeds its diodes brakes,
too. No firmware can change that. The run is repeated in the same plant up to the drive's own reaction, which may not be
later than the line allows; from there on each of the three states is imposed on the bridge. The best of them is the
reference. A fault that has no effect at first cannot be found before it has one: there the times count from the effect.
docs/decisions/023-physical-reference.md argues for both.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Final

import numpy as np

from fluxtrue_tools.fault_campaign.measure import Outcome, mean, outcome
from fluxtrue_tools.fault_campaign.run_point import CHANNELS, Trace

OFF, LOWER, UPPER = "switching disabled", "short circuit below", "short circuit above"
BRIDGE: Final = {OFF: 1, LOWER: 2, UPPER: 3}  # plant.imposed_bridge (PL-31)
SHORT: Final = {OFF: "off", LOWER: "lower", UPPER: "upper"}  # in the names of the results' columns
MARGIN: Final = 1.1
ACTS_NM: Final = 1.0  # a smaller change of the shaft torque is none


@dataclass(frozen=True)
class Reruns:
    """The same run again."""

    imposed: Callable[[int, float], Trace]  # with this state of the bridge from this time on
    healthy: Callable[[], Trace]  # without the fault


NO_CELLS: Final[dict[str, float | str]] = {
    "effect_ms": math.nan, "reference": "", "reference_ms": math.nan,
    **{f"reference_{name}_{unit}": math.nan for name in SHORT.values() for unit in ("Nm", "A", "V")},
}  # fmt: skip


@dataclass(frozen=True)
class Reference:
    """The three states, entered at the same time."""

    entry_ms: float
    states: dict[str, Outcome]
    limits: Outcome

    def _share(self, state: str) -> float:
        """Of the limit that is exceeded most."""
        one = self.states[state]
        return max(one.torque_Nm / self.limits.torque_Nm, one.current_A / self.limits.current_A)

    @property
    def best(self) -> str:
        """The state that exceeds its limits least. A voltage that destroys the inverter is no price for less torque."""
        held = [state for state, one in self.states.items() if one.vdc_V <= self.limits.vdc_V]
        return min(held or self.states, key=self._share)

    def allows(self, run: Outcome) -> bool:
        """Whether torque and current are within their limits, or at most the margin above those of the best state."""
        best, limits = self.states[self.best], self.limits
        torque_Nm = max(limits.torque_Nm, MARGIN * best.torque_Nm)
        current_A = max(limits.current_A, MARGIN * best.current_A)
        return run.torque_Nm <= torque_Nm and run.current_A <= current_A

    @property
    def text(self) -> str:
        """The reference in words."""
        best = self.states[self.best]
        return f"best: {self.best} at {self.entry_ms:.1f} ms, {best.torque_Nm:.1f} N·m, {best.current_A:.0f} A"

    @property
    def cells(self) -> dict[str, float | str]:
        """For the results."""
        found: dict[str, float | str] = NO_CELLS | {"reference": self.best, "reference_ms": self.entry_ms}
        for state, one in self.states.items():
            name = f"reference_{SHORT[state]}"
            found |= {f"{name}_Nm": one.torque_Nm, f"{name}_A": one.current_A, f"{name}_V": one.vdc_V}
        return found


def effect_ms(trace: Trace, healthy: Trace) -> float:
    """When the fault first changes anything in the machine; until then the drive cannot know of it. Infinite: never."""
    columns = [CHANNELS.index(name) for name in CHANNELS if name.startswith("truth.")]
    differs = (trace.rows[:, columns] != healthy.rows[:, columns]).any(axis=1)
    return max(0.0, float(trace.time_ms[differs.argmax()]) - 1e3 * trace.period_s) if differs.any() else math.inf


def acts(trace: Trace, healthy: Trace) -> bool:
    """Whether the shaft torque, as its mean over 5 ms, ever departs from that of the run without the fault."""
    torque = [mean(each["truth.torque_shaft_mean_Nm"], each.period_s) for each in (trace, healthy)]
    return bool((np.abs(torque[0] - torque[1]) > ACTS_NM).any())


def reference(entry_ms: float, safe_ms: float, limits: Outcome, imposed: Callable[[int, float], Trace]) -> Reference:
    """The three states from a time on."""
    states = {state: outcome(imposed(bridge, entry_ms), entry_ms, safe_ms) for state, bridge in BRIDGE.items()}
    return Reference(entry_ms, states, limits)
