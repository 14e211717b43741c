# SPDX-License-Identifier: Apache-2.0
"""What the sensor of the dc voltage shows without voltage: (CM-46), (CM-47).

With the contactor open and the dc link discharged the voltage is zero, and the reading is the offset. A converter that
shows nothing below zero hides a negative one, and a link may keep a charge. So the link is also charged and discharged:
the value to which its readings fall is the offset, too, and the only one where the first is not known.
"""

import math
from dataclasses import dataclass

import numpy as np
from scipy.optimize import curve_fit

from fluxtrue_tools.commission.drive import Capture
from fluxtrue_tools.commission.nameplate import Nameplate
from fluxtrue_tools.motor.config import DC_OFFSET_SHARE_MAX
from fluxtrue_tools.motor.flux_model import Array

SEEN_S = 1.0  # of a discharged link
STEADY = 2.5e-4  # of the full scale: change of the reading in SEEN_S, and what a fall leaves of an exponential, at most
AT_ZERO = 0.02  # share of the readings that may be zero
CERTAIN = 5e-4  # of the full scale: standard deviation of the value to which a fall goes
UNCONFIRMED = 5e-3  # of the full scale: largest offset without a discharge that confirms it; it raises the trip
SIGMAS = 4.0  # of the noise, for a change that is not noise
SAME = 1e-3  # of the full scale: between both measurements
RESTING, FALLEN = "contactor open, dc link discharged", "end of the dc link's discharge"
UPPER, LOWER = 0.9, 1.15  # of the first and of the last reading: between them it falls
FALL_LEAST, FALL_SAMPLES = 0.05, 12  # of the full scale: the lowest reading that is used; readings at least


@dataclass(frozen=True)
class DcZero:
    """The offset, or why it is not known."""

    subtracted_V: float = 0.0  # by this firmware: inverter.v_dc_offset_V
    shown_V: float = 0.0  # beyond it
    sigma_V: float = 0.0
    how: str = ""
    unknown: str = "not measured"

    @property
    def value_V(self) -> float:
        """Of the sensor."""
        return self.subtracted_V + self.shown_V


class UnclearError(Exception):
    """Why readings do not show the offset."""


def _lsb_V(known: Nameplate) -> float:
    return known.v_dc_full_scale_V / float(1 << known.adc_bits)


def _allowed(zero_V: float, known: Nameplate, what: str) -> float:
    least_V, most_V = -DC_OFFSET_SHARE_MAX * known.v_dc_full_scale_V, known.v_dc_offset_max_V
    if not least_V <= known.v_dc_offset_V + zero_V <= most_V:
        raise UnclearError(f"{what} {zero_V:.3g} V, no offset from {least_V:.3g} to {most_V:.3g} V")
    return zero_V


def settled(volts: Array, known: Nameplate) -> tuple[float, float]:
    """(CM-46): mean and standard deviation of the readings of a discharged link.

    Raises UnclearError if the link may still be charged, or the converter shows nothing that low.
    """
    full_V, mean_V = known.v_dc_full_scale_V, float(volts.mean())
    _allowed(mean_V, known, "still charged: the dc link shows, with its contactor open,")
    times = np.linspace(-0.5, 0.5, len(volts))
    slope_V, _ = np.polyfit(times, volts, 1)
    noise_V = float(np.std(volts - slope_V * times))
    if abs(slope_V) > max(STEADY * full_V, SIGMAS * noise_V * math.sqrt(12.0 / len(volts))):
        raise UnclearError(f"not discharged: with its contactor open the dc link changes by {slope_V:+.2g} V in "
                           f"{SEEN_S:g} s")  # fmt: skip
    if float(np.mean(volts <= 0.0)) > AT_ZERO:
        raise UnclearError("the discharged dc link shows 0: the offset is at or below what the firmware subtracts, of "
                           "which the converter shows nothing")  # fmt: skip
    return mean_V, math.hypot(noise_V / math.sqrt(len(volts)), _lsb_V(known) / math.sqrt(12.0))


def _decay(times: Array, end_V: float, height_V: float, rate: float) -> Array:
    return np.asarray(end_V + height_V * np.exp(-rate * times))


def falling(volts: Array, known: Nameplate) -> tuple[float, float]:
    """(CM-47): where the readings of a link that is discharged through a resistor go, and its standard deviation.

    Raises UnclearError if they do not fall like that.
    """
    full_V = known.v_dc_full_scale_V
    low_V = max(LOWER * float(volts[-1]), FALL_LEAST * full_V)
    inside = np.flatnonzero((volts < UPPER * volts[0]) & (volts > low_V))
    if len(inside) < FALL_SAMPLES or volts[inside[0]] < 2.0 * volts[inside[-1]]:
        raise UnclearError("it has not fallen from a charge to half of it either")
    used = volts[inside[0] : inside[-1] + 1]
    times = np.linspace(0.0, 1.0, len(used))
    start = (0.0, float(used[0]), math.log(float(used[0] / used[-1])))
    try:
        found, covariance = curve_fit(_decay, times, used, start)
    except RuntimeError as error:
        raise UnclearError("and charged it does not fall as through a resistor") from error
    left_V = float(np.sqrt(np.mean((used - _decay(times, *found)) ** 2)))
    sigma_V = math.sqrt(float(covariance[0, 0]))
    if left_V > STEADY * full_V or not sigma_V < CERTAIN * full_V:
        raise UnclearError(f"and charged it does not fall as through a resistor: {left_V:.2g} V rms beside it, ±"
                           f"{sigma_V:.2g} V at its end")  # fmt: skip
    return _allowed(float(found[0]), known, "and charged it falls towards"), sigma_V


def _at_rest(drive: Capture, known: Nameplate) -> tuple[float, float]:
    why = drive.discharge()
    if why:
        raise UnclearError(why)
    return settled(drive.dc_link_V(SEEN_S), known)


def _agreed(at_rest: tuple[float, float], fallen: tuple[float, float], known: Nameplate) -> tuple[float, float, str]:
    """A charge that a link loses slowly is seen as an offset, which is then larger than where a fall goes."""
    more_V = at_rest[0] - fallen[0]
    if more_V > SAME * known.v_dc_full_scale_V:
        return *fallen, f"{FALLEN}; discharged it still had {more_V:.2g} V"
    if -more_V > SAME * known.v_dc_full_scale_V:
        raise UnclearError(f"the dc link falls towards {fallen[0]:.3g} V and shows {at_rest[0]:.3g} V when it is "
                           "discharged")  # fmt: skip
    return *at_rest, f"{RESTING}, as its discharge confirms"


def _found(drive: Capture, known: Nameplate) -> tuple[float, float, str]:
    try:
        at_rest = _at_rest(drive, known)
    except UnclearError as first:
        try:
            return *falling(drive.falling_link_V(), known), FALLEN
        except UnclearError as second:
            raise UnclearError(f"{first}; {second}") from second
    try:
        fallen = falling(drive.falling_link_V(), known)
    except UnclearError as why:
        if at_rest[0] > UNCONFIRMED * known.v_dc_full_scale_V:
            raise UnclearError(f"the dc link shows {at_rest[0]:.3g} V with its contactor open, which may be a charge; "
                               f"{why}") from why  # fmt: skip
        return *at_rest, f"{RESTING}; a charge that it loses slowly is not excluded"
    return _agreed(at_rest, fallen, known)


def measure(drive: Capture, known: Nameplate) -> DcZero:
    """With switching disabled."""
    try:
        return DcZero(known.v_dc_offset_V, *_found(drive, known), unknown="")
    except UnclearError as why:
        return DcZero(known.v_dc_offset_V, unknown=str(why))
    finally:
        drive.end_discharge()
