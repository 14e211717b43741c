# SPDX-License-Identifier: Apache-2.0
"""The firmware's voltage pulses: when they are refused, and how they end."""

import math
from collections.abc import Mapping
from dataclasses import replace

import pytest

from fluxtrue_tools.commission import along_q, hidden, plan
from fluxtrue_tools.commission.bursts import FAILURES, STARTS, Burst, Raw, record
from fluxtrue_tools.commission.drive import SIGNALS, Capture, SoftwareInTheLoop
from fluxtrue_tools.commission.nameplate import Nameplate
from fluxtrue_tools.commission.shown import Losses
from fluxtrue_tools.errors import FluxtrueError
from fluxtrue_tools.motor.flux_model import Array
from fluxtrue_tools.sim.library import Loop
from fluxtrue_tools.sim.motor import Motor

PULSE, DONE, FAILED = 1.0, 3.0, 4.0
REFUSED, STOPPED, TIME, CURRENT, NO_CONSENT = 1.0, 2.0, 4.0, 5.0, 6.0
LONG = Burst(0.2, 0.0, (-50.0, 50.0), (-50.0, 50.0), reversals=1000, periods=2000)


@pytest.fixture
def drive(unknown: Motor, known: Nameplate) -> SoftwareInTheLoop:
    made, _ = hidden.make("saturated", 1, unknown, known.i_max_A)
    made.set("enable", 1.0)
    made.capture(SIGNALS, 500)
    assert made.get("run_state") == 1.0
    return made


def outcome(drive: SoftwareInTheLoop) -> tuple[float, float]:
    return drive.get("pulses"), drive.get("pulses_failure")


def test_a_burst_ends_without_current(drive: SoftwareInTheLoop) -> None:
    Burst(0.2, 0.0, (-50.0, 50.0), (-50.0, 50.0), reversals=4).command(drive)
    rows = drive.capture(SIGNALS, 500)
    assert outcome(drive) == (DONE, 0.0)
    assert 35.0 < abs(rows[:, 0]).max() < 55.0
    assert abs(rows[-100:, 0]).max() < 5.0


def test_without_switching_it_is_refused(drive: SoftwareInTheLoop) -> None:
    drive.set("enable", 0.0)
    drive.capture(SIGNALS, 500)
    drive.set("pulses_agreed", 1.0)
    LONG.command(drive)
    rows = drive.capture(SIGNALS, 100)
    assert outcome(drive) == (FAILED, REFUSED)
    assert abs(rows[:, 2:4]).max() == 0.0


def test_without_a_consent_it_is_refused_with_one_message(drive: SoftwareInTheLoop, known: Nameplate) -> None:
    drive.set("pulses_agreed", 0.0)
    LONG.command(drive)
    rows = drive.capture(SIGNALS, 100)
    assert outcome(drive) == (FAILED, NO_CONSENT)
    with pytest.raises(FluxtrueError, match="^commission: voltage pulses without a consent"):
        record(drive, LONG, known)
    assert abs(rows[:, 0]).max() < 5.0


def test_the_end_of_the_consent_ends_it_and_in_run_there_is_no_new_one(drive: SoftwareInTheLoop) -> None:
    LONG.command(drive)
    drive.capture(SIGNALS, 50)
    assert drive.get("pulses") == PULSE
    drive.set("pulses_agreed", 0.0)
    rows = drive.capture(SIGNALS, 200)
    assert outcome(drive) == (FAILED, NO_CONSENT) and drive.get("run_state") == 1.0
    assert abs(rows[100:, 0]).max() < 5.0
    drive.set("pulses_agreed", 1.0)
    LONG.command(drive)
    drive.capture(SIGNALS, 50)
    assert outcome(drive) == (FAILED, NO_CONSENT)


@pytest.mark.parametrize("name", ["torque_requested_Nm", "iq_ref_A"])
def test_with_a_request_it_is_refused(name: str, drive: SoftwareInTheLoop) -> None:
    drive.set("current_mode", float(name == "iq_ref_A"))
    drive.set(name, 1.0)
    drive.capture(SIGNALS, 20)
    LONG.command(drive)
    drive.capture(SIGNALS, 50)
    assert outcome(drive) == (FAILED, REFUSED)


@pytest.mark.parametrize(("name", "value"), [("pulses_id_low_A", 60.0), ("pulses_iq_high_A", -60.0)])
def test_bounds_without_a_band_between_them_are_refused(name: str, value: float, drive: SoftwareInTheLoop) -> None:
    wanted = {"pulses_vd": 0.2, "pulses_id_low_A": -50.0, "pulses_id_high_A": 50.0, "pulses_iq_low_A": -50.0,
              "pulses_iq_high_A": 50.0, "pulses_reversals": 4.0, "pulses_periods": 100.0}  # fmt: skip
    for each, amount in (wanted | {name: value}).items():
        drive.set(each, amount)
    drive.set("pulses", 1.0)
    drive.capture(SIGNALS, 50)
    assert outcome(drive) == (FAILED, REFUSED)


def test_a_lost_command_ends_it_in_the_safe_state(drive: SoftwareInTheLoop) -> None:
    LONG.command(drive)
    drive.capture(SIGNALS, 50)
    assert drive.get("pulses") == PULSE
    drive.set("enable", 0.0)
    rows = drive.capture(SIGNALS, 200)
    assert outcome(drive) == (FAILED, STOPPED)
    assert drive.get("run_state") != 1.0
    assert abs(rows[100:, 2:4]).max() == 0.0


def test_a_request_ends_it(drive: SoftwareInTheLoop) -> None:
    LONG.command(drive)
    drive.capture(SIGNALS, 50)
    drive.set("torque_requested_Nm", 1.0)
    drive.capture(SIGNALS, 50)
    assert outcome(drive) == (FAILED, STOPPED)


def test_its_time_is_limited(drive: SoftwareInTheLoop) -> None:
    Burst(0.2, 0.0, (-50.0, 50.0), (-50.0, 50.0), reversals=1000, periods=100).command(drive)
    drive.capture(SIGNALS, 300)
    assert outcome(drive) == (FAILED, TIME)


def test_a_current_beyond_the_largest_ends_it(unknown: Motor, known: Nameplate) -> None:
    """The voltage is far too large for this machine: the prediction comes too late."""
    drive, _ = hidden.make("spm_12V", 1, unknown, known.i_max_A)
    drive.set("enable", 1.0)
    drive.capture(SIGNALS, 500)
    Burst(0.15, 0.0, (-25.0, 25.0), (-25.0, 25.0), reversals=10).command(drive)
    drive.capture(SIGNALS, 100)
    assert drive.get("pulses") != DONE
    assert drive.get("pulses_failure") == CURRENT or drive.get("fault_word") != 0.0


class Hesitant(SoftwareInTheLoop):
    """Refuses so many starts, as for a speed that seems not to be zero."""

    strikes = False  # the half waves that brake a rotor are starts, too
    refusals = 0
    starts = 0
    allowed_rad = 0.0

    def pulse(self, values: Mapping[str, float]) -> Array:
        self.starts += 1
        self.allowed_rad = values["pulses_angle_rad"]
        self.set("torque_requested_Nm", float(self.starts <= self.refusals))
        self.rest(0.005)
        rows = super().pulse(values)
        self.set("torque_requested_Nm", 0.0)
        return rows


@pytest.fixture
def hesitant(unknown: Motor, known: Nameplate) -> Hesitant:
    _, flux_map, plant = hidden.draw("saturated", 1, unknown, known.i_max_A)
    made = Hesitant(Loop(unknown.library, plant, flux_map))
    made.set("enable", 1.0)
    made.rest(0.05)
    return made


def test_a_start_that_is_refused_is_tried_again(hesitant: Hesitant, known: Nameplate) -> None:
    hesitant.refusals = STARTS - 1
    raw = record(hesitant, Burst(0.2, 0.0, (-50.0, 50.0), (-50.0, 50.0), reversals=4), known)
    assert hesitant.starts == STARTS
    assert raw.failure == "" and abs(raw.i.real).max() > 35.0


def test_a_start_that_is_always_refused_ends_the_step(hesitant: Hesitant, known: Nameplate) -> None:
    hesitant.refusals = 1000
    with pytest.raises(FluxtrueError, match="voltage pulses refused"):
        record(hesitant, Burst(0.2, 0.0, (-50.0, 50.0), (-50.0, 50.0), reversals=4), known)
    assert hesitant.starts == STARTS


@pytest.mark.parametrize(("pole_pairs", "degrees"), [(2, 15.0), (4, 15.0), (8, 30.0), (50, 44.0)])
def test_with_many_pole_pairs_the_rotor_may_move_by_more_electrical_degrees(
    pole_pairs: int, degrees: float, hesitant: Hesitant, known: Nameplate
) -> None:
    """3.75 degrees of the shaft; the firmware takes up to 45 electrical degrees."""
    burst = Burst(0.2, 0.0, (-50.0, 50.0), (-50.0, 50.0), reversals=4)
    assert record(hesitant, burst, replace(known, pole_pairs=pole_pairs)).failure == ""
    assert math.degrees(hesitant.allowed_rad) == pytest.approx(degrees)


@pytest.mark.parametrize("samples", [1, 3])
def test_the_next_burst_is_planned_from_the_last_valid_one(
    drive: SoftwareInTheLoop, known: Nameplate, monkeypatch: pytest.MonkeyPatch, samples: int
) -> None:
    """Two bursts of all may fail. What they recorded before is no measure of how fast the current changes."""
    asked: list[Burst] = []

    def recorded(of: Capture, burst: Burst, plate: Nameplate) -> Raw:
        raw = record(of, burst, plate)
        asked.append(burst)
        if sum(each.v_d > 0.0 and each.v_q > 0.0 for each in asked) != 3:
            return raw
        i, u, theta, zero = (values[:samples] for values in (raw.i, raw.u, raw.theta, raw.zero))
        return replace(raw, i=i, u=u, theta=theta, zero=zero, failure=FAILURES[4])

    losses = Losses(known.r_ohm, 0.0)
    first = plan.first(drive, known, losses)
    monkeypatch.setattr(along_q, "record", recorded)
    raws = plan.sweep(drive, first, known, losses)
    assert [raw.is_valid for raw in raws].count(False) == 1
    at_bias = [burst for burst in asked if burst.v_d > 0.0 and burst.v_q > 0.0]
    assert [burst.d for burst in at_bias[::2]] == [burst.d for burst in at_bias[1::2]]
    _, second, _, fourth, *_ = at_bias
    assert all(0.0 < burst.first <= 1.0 for burst in asked)
    assert fourth.v_q <= along_q.TRIED[-1] * plan.FASTER * second.v_q
