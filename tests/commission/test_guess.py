# SPDX-License-Identifier: Apache-2.0
"""Inductances up to ten times smaller or larger than the nameplate's guess are safe, as start.py says of its gains."""

import numpy as np
import pytest

from fluxtrue_tools.commission import hidden
from fluxtrue_tools.commission.metered import Metered
from fluxtrue_tools.commission.nameplate import Nameplate
from fluxtrue_tools.commission.steps import chosen, run
from fluxtrue_tools.errors import FluxtrueError
from fluxtrue_tools.sim.library import Loop
from fluxtrue_tools.sim.motor import Motor

EDGES = [(0.1, 0.1), (0.1, 10.0), (1.0, 1.0), (10.0, 0.1), (10.0, 10.0)]  # of the guess, along d and q
WANTED, LARGEST = 0.2, 0.45  # of i_max
RIPPLE = 0.01
CURRENT_MAX = 17.0 / 16.0  # square of the share of i_max at which the firmware ends a burst


def with_inductances(along_d: float, along_q: float, unknown: Motor, known: Nameplate, **plant: float) -> Metered:
    """Of a machine without saturation, as multiples of the nameplate's guess."""
    guess_H = known.psi_f_Vs / known.i_max_A
    truth, _, base = hidden.draw("linear", 103, unknown, known.i_max_A)
    ones = dict.fromkeys(("magnet_scale", "lq_scale", "ld_slope_scale", "cross_saturation_scale"), 1.0)
    own = {"ld_H": along_d * guess_H, "lq_H": along_q * guess_H, "psi_f_Vs": truth.psi_f_Vs}
    return Metered(Loop(unknown.library, base | ones | own | plant, None))


def current_along_q(drive: Metered, known: Nameplate, compensation: float) -> tuple[float, float]:
    """Largest current after a step of the reference to WANTED, as a share of i_max; ripple in the end, of WANTED."""
    drive.set("machine_monitors", 0.0)
    drive.set("dead_time_compensation", compensation)
    drive.set("enable", 1.0)
    drive.rest(0.05)
    drive.push(1j * WANTED * known.i_max_A)
    i_q = drive.capture(("iq_A",), round(1.0 / drive.period_s))[:, 0]
    return drive.largest_A / known.i_max_A, float(np.std(i_q[-2000:])) / (WANTED * known.i_max_A)


def held(along_d: float, along_q: float, unknown: Motor, known: Nameplate, compensation: float) -> tuple[float, float]:
    drive = with_inductances(along_d, along_q, unknown, known, imposed_speed=1.0, speed_rad_s=0.0,
                             current_noise_A_rms=0.0)  # fmt: skip
    largest, ripple = current_along_q(drive, known, compensation)
    print(f"{along_d} {along_q}: largest {largest:.3f} i_max, ripple {ripple:.4f}")
    assert drive.get("fault_word") == 0.0
    return largest, ripple


@pytest.mark.parametrize(("along_d", "along_q"), EDGES)
def test_the_gains_of_the_nameplate_are_stable(
    along_d: float, along_q: float, unknown: Motor, known: Nameplate
) -> None:
    """The largest inductance overshoots most, because its current rises slowly: 85 A of 50 A. With the compensation of
    the dead time all of its voltage acts as soon as the current leaves zero, before the gains can take it back."""
    largest, ripple = held(along_d, along_q, unknown, known, compensation=0.0)
    assert largest <= 2.0 * WANTED and ripple <= RIPPLE
    largest, _ = held(along_d, along_q, unknown, known, compensation=1.0)
    assert largest <= LARGEST


def test_a_hundredth_of_the_guess_is_not_safe(unknown: Motor, known: Nameplate) -> None:
    """The bounds above notice a loop gain that is too high."""
    largest, ripple = held(0.01, 0.01, unknown, known, compensation=0.0)
    assert largest > 2.0 * WANTED or ripple > RIPPLE


@pytest.mark.parametrize(("along_d", "along_q"), EDGES)
def test_the_first_pulses_keep_the_largest_current(
    along_d: float, along_q: float, unknown: Motor, known: Nameplate
) -> None:
    """Where one axis has a hundred times the inductance of the other a current may not be reached in time: a refusal
    without a fault."""
    drive = with_inductances(along_d, along_q, unknown, known)
    try:
        found = run(drive, chosen(("resistance",)), known, lambda _: None)
        assert found.resistance is not None
    except FluxtrueError as refused:
        print(refused)
        assert along_d != along_q and ("in time" in str(refused) or "the rotor moved" in str(refused))
    share = drive.largest_A / known.i_max_A
    print(f"{along_d} {along_q}: {share:.3f} i_max")
    assert 0.1 < share <= np.sqrt(CURRENT_MAX)
    assert drive.get("fault_word") == 0.0 and drive.get("run_state") != 1.0
