# SPDX-License-Identifier: Apache-2.0
"""The interface of a commissioning to a drive: names, signals recorded in each PWM period, voltage pulses.

There are two implementations. In software in the loop the firmware runs as a library in this process beside a simulated
machine; it is recorded by reading the names after each period. An ECU on a bus (bus.py) is commanded by protected
frames and recorded by the scope of its firmware.
"""

import cmath
import math
from collections.abc import Callable, Mapping, Sequence
from typing import Protocol

import numpy as np

from fluxtrue_tools.errors import FluxtrueError
from fluxtrue_tools.motor.flux_model import Array
from fluxtrue_tools.sim.library import Loop

HIDDEN = ("plant.", "truth.")  # what belongs to the simulated machine, not to the drive
MEASURED = ("id_A", "iq_A", "ud_V", "uq_V", "theta_e_rad", "i_zero_A")
SIGNALS = (*MEASURED, "pulses")
PULSE, DONE, FAILED = 1.0, 3.0, 4.0  # of the name pulses
CHUNK, SHORT_CHUNK = 200, 20  # periods recorded at once; of a half wave that brakes, which hold() follows at once
PERIODS_MAX = 4000
SEEN_S, FALLS = 0.01, 6  # a speed is measured in this time, at most so many times until a current has fallen
STANDING_RPM = 0.5
LIGHTNESS = 4.0  # before it is known: a rotor that is lighter is turned back less
VOLTAGES = ("ud_V", "uq_V")  # which the drive has computed with the dc voltage that its sensor shows
LINK = {"dc_link_F": 5e-4, "dc_load_ohm": 40.0, "contactor_open": 0.0}  # of the bench: falls to 1/e in 20 ms
LINK_EMPTY_S, LINK_FALLS_S = 0.3, 0.1
CONNECTION = ("angle_pole_pairs", "angle_reversed", "angle_offset_rad", "angle_imposed")


def voltage_share(dc_zero_V: float, shown_V: float) -> float:
    """Of a voltage that the drive has computed with the dc voltage that its sensor shows, which the inverter makes of
    it (CM-48). dc_zero_V: the sensor's offset, of which the drive does not know."""
    return 1.0 - dc_zero_V / shown_V if dc_zero_V else 1.0


def nothing(_: float) -> None:
    """The time that has passed is not shown."""


class Capture(Protocol):
    """A drive that can be commanded and recorded."""

    settings: tuple[str, ...]  # names that a commissioning changes, and sets back at its end
    switched_off: tuple[str, ...]  # those of them that would act by the guesses of the nameplate
    passed: Callable[[float], None]  # called with the seconds for which the drive has run
    slower: float  # how many times longer it runs than software in the loop
    brake_s: float  # of a current that brakes the rotor
    lightness: float  # of the rotor, as a multiple of the guess: what the braking currents have shown
    strikes: bool  # a heavy rotor is braked by pulses
    # What the dc voltage's sensor shows without voltage, beyond what the firmware subtracts; captured voltages and
    # compensation_V are corrected for it.
    dc_zero_V: float
    struck: float  # change of the speed by a half wave of pulses over the square of its bound, rpm/A^2; 0: not known

    @property
    def period_s(self) -> float:
        """The PWM period."""

    def set(self, name: str, value: float) -> None:
        """A value of the drive."""

    def get(self, name: str) -> float:
        """The value now."""

    def capture(self, names: Sequence[str], periods: int) -> Array:
        """Let the drive run; one row for each period, a column for each name."""

    def rest(self, seconds: float) -> None:
        """Let the drive run."""

    def speed_rpm(self, seconds: float) -> float:
        """Let the drive run; the mean speed in this time, over CAN the reported one at its end."""

    def free_speed_rpm(self) -> float:
        """Let the drive run until a current of push() has fallen; return the speed."""

    def push(self, current_A: complex, offset_A: complex = 0j) -> None:
        """A small current in the rotor frame, until let_go(); the offsets of the sensors, in the stationary frame, are
        what they show without any."""

    def hold(self, offset_A: complex) -> None:
        """No current in the machine, although the sensors show their offsets, until a start of pulses. Over CAN only
        the requested torque is zero, and the current of the offsets remains."""

    def let_go(self) -> None:
        """No current and no torque is requested any more."""

    def discharge(self) -> str:
        """Open the contactor and discharge the dc link as far as the drive does; why it cannot, or nothing."""

    def dc_link_V(self, seconds: float) -> Array:
        """What the dc voltage's sensor shows, in equal steps."""

    def falling_link_V(self) -> Array:
        """The same from a charged dc link to a discharged one."""

    def end_discharge(self) -> None:
        """The contactor may close again."""

    def prepare(self, values: Mapping[str, float]) -> None:
        """Do what takes time before pulse() with the same values."""

    def pulse(self, values: Mapping[str, float]) -> Array:
        """Set the values of voltage pulses, end hold(), start them at once and wait for their end; one row of SIGNALS
        for each period."""


class SoftwareInTheLoop:
    """The firmware as a library, on a simulated machine of which nothing but the drive's names can be read."""

    switched_off: tuple[str, ...] = ("trim",)
    settings: tuple[str, ...] = switched_off + CONNECTION
    slower: float = 1.0
    brake_s: float = 0.005
    strikes = True

    def __init__(self, loop: Loop) -> None:
        self._loop = loop
        self.period_s = loop.period_s
        self.passed: Callable[[float], None] = nothing
        self.lightness = LIGHTNESS
        self.struck = self.dc_zero_V = 0.0
        self._link: Loop | None = None  # without its battery

    @staticmethod
    def _allowed(name: str) -> str:
        if name.startswith(HIDDEN):
            raise FluxtrueError(f"{name}: belongs to the simulated machine, which a commissioning cannot read")
        return name

    def set(self, name: str, value: float) -> None:
        """A value of the drive. The consent to pulses comes before switching is enabled, as over CAN."""
        if name == "enable":
            self._loop.set("pulses_agreed", value)
        self._loop.set(self._allowed(name), value)

    def get(self, name: str) -> float:
        """The value now."""
        value = self._loop.get(self._allowed(name))
        if math.isnan(value):
            raise FluxtrueError(f"{name}: this firmware has no such value")
        return value * self._voltage_share() if name == "compensation_V" else value

    def _voltage_share(self) -> float:
        return voltage_share(self.dc_zero_V, self._loop.get("vdc_V"))

    def capture(self, names: Sequence[str], periods: int) -> Array:
        """Every period, by reading the names after it."""
        return self._recorded([self._allowed(name) for name in names], periods)

    def _recorded(self, names: Sequence[str], periods: int) -> Array:
        """Also of names that a commissioning cannot read."""
        self._loop.record(list(names))
        rows = self._loop.run(periods)
        self.passed(periods * self.period_s)
        voltages = [n for n, name in enumerate(names) if name in VOLTAGES]
        if voltages:
            rows[:, voltages] *= self._voltage_share()
        return rows

    def rest(self, seconds: float) -> None:
        """Let the drive run."""
        self.capture(("run_state",), round(seconds / self.period_s))

    def speed_rpm(self, seconds: float) -> float:
        """Let the drive run; its mean speed, by the angle: the speed that the drive reports follows some milliseconds
        later, in which a light rotor turns back."""
        theta = np.unwrap(self.capture(("theta_e_rad",), round(seconds / self.period_s))[:, 0])
        slope = float(np.polyfit(self.period_s * np.arange(len(theta)), theta, 1)[0])
        return slope / self.get("angle_pole_pairs") * 30.0 / math.pi

    def free_speed_rpm(self) -> float:
        """With gains for a machine that is not known the fall takes some milliseconds: the speed changes until then."""
        speed = self.speed_rpm(SEEN_S)
        for _ in range(FALLS):
            before, speed = speed, self.speed_rpm(SEEN_S)
            if abs(speed - before) < STANDING_RPM:
                break
        return speed

    def push(self, current_A: complex, offset_A: complex = 0j) -> None:
        """References of the current control."""
        shown_A = current_A + (offset_A * cmath.exp(-1j * self.get("theta_e_rad")) if offset_A else 0j)
        self.set("current_mode", 1.0)
        self.set("id_ref_A", shown_A.real)
        self.set("iq_ref_A", shown_A.imag)

    def hold(self, offset_A: complex) -> None:
        """References as the sensors' offsets."""
        self.push(0j, offset_A)

    def let_go(self) -> None:
        """Remove all references."""
        self.set("id_ref_A", 0.0)
        self.set("iq_ref_A", 0.0)
        self.set("current_mode", 0.0)

    # The dc link is measured on a second simulation, so that the noise of the other steps does not change.

    def _link_V(self, seconds: float) -> Array:
        assert self._link is not None
        self._link.record(("vdc_V",))
        rows = self._link.run(round(seconds / self.period_s))
        self.passed(seconds)
        return rows[:, 0]

    def _open_contactor(self) -> None:
        self._link = self._loop.again(LINK)
        self._link_V(LINK_FALLS_S)
        self._link.set("plant.contactor_open", 1.0)

    def discharge(self) -> str:
        """The bench opens its contactor beside a resistor."""
        self._open_contactor()
        self._link_V(LINK_EMPTY_S)
        return ""

    def dc_link_V(self, seconds: float) -> Array:
        """Every period."""
        return self._link_V(seconds)

    def falling_link_V(self) -> Array:
        """From the battery's voltage on."""
        self._open_contactor()
        return self._link_V(LINK_FALLS_S)

    def end_discharge(self) -> None:
        """The bench closes its contactor."""
        self._link = None

    def prepare(self, values: Mapping[str, float]) -> None:
        """Nothing: setting the values takes no time."""

    def pulse(self, values: Mapping[str, float]) -> Array:
        """Recorded from before their start to after their end."""
        for name, value in values.items():
            self.set(name, value)
        self.let_go()
        self.set("pulses", PULSE)
        chunk = SHORT_CHUNK if values["pulses_reversals"] == 1.0 else CHUNK
        parts = [self.capture(SIGNALS, chunk)]
        while parts[-1][-1, -1] not in (DONE, FAILED):
            parts.append(self.capture(SIGNALS, chunk))
            if len(parts) * chunk > 2 * PERIODS_MAX:
                raise FluxtrueError("commission: the voltage pulses do not end")
        return np.vstack(parts)
