# SPDX-License-Identifier: Apache-2.0
"""The table of faults is read strictly, and the evaluation finds wrong torque, current, voltage and times."""

import math
from typing import Any

import numpy as np
import pandas as pd
import pytest

from fluxtrue_tools.errors import FluxtrueError
from fluxtrue_tools.fault_campaign import fmea
from fluxtrue_tools.fault_campaign.fmea import COLUMNS, MET, NO_EFFECT, OPEN, PHYSICS, Point, Row
from fluxtrue_tools.fault_campaign.oracle import BRIDGE, LOWER, OFF, UPPER, Reruns
from fluxtrue_tools.fault_campaign.run_point import BEFORE_MS, CHANNELS, Trace
from fluxtrue_tools.fault_campaign.score import Score, score, summarise
from fluxtrue_tools.fault_campaign.spec import Bounded
from fluxtrue_tools.fault_campaign.verdict import evaluate
from fluxtrue_tools.sim.ecu_loop import RUN, EcuLoop
from fluxtrue_tools.sim.motor import load

CELLS = {"id": "a-line", "element": "sensor", "failure": "fails", "injection": "plant.vdc_gain=0.7",
         "reaction": "safe_state", "expected": "over_current", "detect_ms": "10", "torque_ms": "50",
         "status": "met"}  # fmt: skip
POINT = Point(0, 1.0, "hsm1", 0.2, 0.5, 2000.0, 60.0)
BOUNDS = Bounded(motor="hsm1", current_A=500.0, vdc_V=450.0)
AFTER_MS, STEP_MS = 200, 0.1


def text(**cells: str) -> str:
    line = dict.fromkeys(COLUMNS, "") | CELLS | cells
    return ",".join(COLUMNS) + "\n" + ",".join(line[name] for name in COLUMNS) + "\n"


def row(**cells: str) -> Row:
    return fmea.parse(text(**cells), "t.csv")[0]


def trace(fault_ms: float = 5.0, torque: Any = None, amperes: float = 200.0, volts: float = 350.0,
          requested: tuple[float, float] = (60.0, 60.0), state: int = 6, rad_s: float = 0.0) -> Trace:  # fmt: skip
    """A recorded run: 60 N·m until fault_ms, then no torque; from there on the fault over_current."""
    count = round((BEFORE_MS + AFTER_MS) / STEP_MS)
    time = (np.arange(count) + 1) * STEP_MS - BEFORE_MS
    rows = np.zeros((count, len(CHANNELS)))
    made = np.where(time < fault_ms, 60.0, 0.0) if torque is None else torque(time)
    columns = {"truth.torque_shaft_mean_Nm": made, "truth.i_d_A": -amperes, "truth.vdc_V": volts,
               "fault_word": np.where(time >= fault_ms, 1.0, 0.0)}  # fmt: skip
    columns["truth.theta_m_rad"] = (rad_s * 1e-3 * time + math.pi) % (2.0 * math.pi)
    for name, values in columns.items():
        rows[:, CHANNELS.index(name)] = values
    return Trace(STEP_MS * 1e-3, rows, requested, [(ms + 1.0, 0, state) for ms in range(AFTER_MS)])


def verdict(line: Row, run: Trace) -> dict[str, Any]:
    return evaluate(line, BOUNDS, 132.0, POINT, run)


def test_the_right_fault_in_time_with_safe_torque_is_met() -> None:
    found = verdict(row(), trace())
    assert found["met"], found["why"]
    assert found["detect_ms"] == pytest.approx(5.0, abs=0.2)


@pytest.mark.parametrize(
    ("run", "why"),
    [
        ({"fault_ms": 12.0}, "over_current after 12.0 ms"),
        ({"fault_ms": math.inf}, "no fault"),
        ({"torque": lambda t: np.where(t < 0, 60.0, -40.0)}, "30.0 N·m beyond its safe range until 200 ms"),
        ({"torque": lambda t: np.where(t < 0.05, 60.0, 75.0)}, "5.0 N·m beyond its safe range until 200 ms"),
        ({"amperes": 501.0}, "501 A"),
        ({"volts": 451.0}, "451 V"),
        ({"torque": lambda t: np.where(t < 150, 0.0, np.nan)}, "lost its numbers"),
    ],
)
def test_each_thing_that_is_wrong_is_named(run: dict[str, Any], why: str) -> None:
    found = verdict(row(), trace(**run))
    assert not found["met"]
    assert why in found["why"]


def test_a_short_peak_of_torque_within_the_time_allowed_is_no_harm() -> None:
    peak = trace(torque=lambda t: np.where((t > 0) & (t < 30), -100.0, np.where(t < 0, 60.0, 0.0)))
    assert verdict(row(), peak)["met"]
    assert not verdict(row(torque_ms="20"), peak)["met"]


def test_a_healthy_drive_that_trips_or_gives_other_torque_is_found() -> None:
    line = row(reaction="keep", expected="", torque_Nm="3", torque_ms="0")
    steady = trace(fault_ms=math.inf, state=RUN, torque=lambda t: np.full(t.shape, 60.0))
    assert verdict(line, steady)["met"]
    assert "false trip" in verdict(line, trace())["why"]
    assert not verdict(line, trace(fault_ms=math.inf, state=RUN, torque=lambda t: np.where(t < 0, 60.0, 50.0)))["met"]
    assert "left state run" in verdict(line, trace(fault_ms=math.inf, state=3,
                                                   torque=lambda t: np.full(t.shape, 60.0)))["why"]  # fmt: skip


def test_a_changed_request_must_be_followed() -> None:
    line = row(reaction="keep", expected="", torque_Nm="3", torque_ms="0")
    run = trace(fault_ms=math.inf, state=RUN, requested=(60.0, 0.0), torque=lambda t: 60.0 * (t < 30.0))
    assert verdict(line, run)["met"]
    late = trace(fault_ms=math.inf, state=RUN, requested=(60.0, 0.0), torque=lambda t: 60.0 * (t < 100.0))
    assert not verdict(line, late)["met"]


def test_an_error_of_torque_may_be_bounded_instead_of_detected() -> None:
    line = row(reaction="bounded")
    assert verdict(line, trace(fault_ms=math.inf, torque=lambda t: np.where(t < 0, 60.0, 52.0)))["met"]
    assert not verdict(line, trace(fault_ms=math.inf, torque=lambda t: np.where(t < 0, 60.0, 45.0)))["met"]
    assert verdict(line, trace(fault_ms=8.0, torque=lambda t: np.where(t < 0, 60.0, 0.0)))["met"]


def launch(torque_Nm: float, rad_s: float, fault_ms: float = math.inf) -> Trace:
    """60 N·m are requested of a machine without torque; this torque follows, until the fault."""
    return trace(fault_ms, lambda t: torque_Nm * ((t > 0.0) & (t < fault_ms)), requested=(0.0, 60.0), rad_s=rad_s)


def test_torque_between_zero_and_a_new_request_needs_no_fault() -> None:
    line = row(reaction="bounded", detect_ms="", torque_ms="200")
    assert verdict(line, launch(20.0, 0.0))["met"]
    assert verdict(line, launch(69.0, 0.0))["met"]
    assert "no fault" in verdict(line, launch(71.0, 0.0))["why"]
    assert "no fault" in verdict(line, launch(-11.0, 0.0))["why"]
    assert verdict(line, launch(-11.0, 0.0, 150.0))["met"]


def test_a_movement_against_the_request_is_bounded_until_the_fault() -> None:
    """3.556 cm per radian: -10 rad/s is 5 cm after 140.6 ms. 20 rad/s are one and a half turns of the rotor."""
    line = row(reaction="bounded", detect_ms="", torque_ms="", against_cm="5")
    assert verdict(line, launch(-30.0, -10.0, 140.0))["met"]
    assert verdict(line, launch(-30.0, -10.0, 142.0))["why"] == "5.0 cm against the request"
    assert verdict(line, launch(-5.0, -10.0))["why"] == "7.1 cm against the request"
    assert verdict(line, launch(-5.0, -50.0))["against_cm"] == pytest.approx(35.6, abs=0.1)
    assert verdict(line, launch(20.0, 50.0))["met"]
    assert (
        "torque" in verdict(line, trace(100.0, lambda t: np.where(t > 0.0, -30.0, 0.0), requested=(0.0, 60.0)))["why"]
    )


def test_a_lost_command_must_end_in_no_torque_without_a_fault() -> None:
    line = row(reaction="ramp", expected="", torque_Nm="5", torque_ms="60")
    assert verdict(line, trace(fault_ms=math.inf, torque=lambda t: 60.0 * (t < 50.0)))["met"]
    assert not verdict(line, trace(fault_ms=math.inf, torque=lambda t: np.full(t.shape, 60.0)))["met"]


def braking(torque_Nm: float, amperes: float = 200.0, volts: float = 350.0, **more: Any) -> Trace:
    """60 N·m, then a safe state that brakes for good."""
    made = {"torque": lambda t: np.where(t < 5.0, 60.0, -torque_Nm), "amperes": amperes, "volts": volts} | more
    return trace(**made)


class States:
    """Stands for the runs with an imposed state; remembers when each was entered."""

    def __init__(self, off: Trace, lower: Trace, upper: Trace, healthy: Trace | None = None) -> None:
        self.traces = {BRIDGE[OFF]: off, BRIDGE[LOWER]: lower, BRIDGE[UPPER]: upper}
        self.without_fault = healthy
        self.entered: list[float] = []

    def imposed(self, bridge: int, at_ms: float) -> Trace:
        self.entered.append(at_ms)
        return self.traces[bridge]

    def healthy(self) -> Trace:
        return self.without_fault or trace(fault_ms=math.inf, torque=lambda t: np.full(t.shape, 60.5))

    @property
    def reruns(self) -> Reruns:
        return Reruns(self.imposed, self.healthy)


def compared(run: Trace, off: Trace, lower: Trace, upper: Trace, **cells: str) -> dict[str, Any]:
    return evaluate(row(**cells), BOUNDS, 132.0, POINT, run, States(off, lower, upper).reruns)


def test_a_run_as_good_as_the_best_safe_state_is_met_and_says_so() -> None:
    """50 N·m brake where 10 are allowed and the best state brakes with 48."""
    found = compared(braking(50.0), braking(120.0), braking(48.0), braking(90.0))
    assert (found["verdict"], found["met"], found["reference"]) == (PHYSICS, True, LOWER)
    assert "torque 40.0 N·m beyond its safe range" in found["why"]
    assert "safe state 50.0 N·m, 200 A, best: short circuit below at 5.0 ms, 48.0 N·m, 200 A" in found["why"]
    assert (found["reference_off_Nm"], found["reference_upper_Nm"]) == (120.0, 90.0)


def test_a_wrong_reaction_is_not_met_although_no_state_is_within_the_limits() -> None:
    """The drive disables switching where the short circuit is best."""
    found = compared(braking(120.0), braking(120.0), braking(48.0), braking(90.0))
    assert (found["verdict"], found["met"]) == (OPEN, False)


@pytest.mark.parametrize(("torque_Nm", "verdict"), [(10.0, MET), (52.7, PHYSICS), (52.9, OPEN)])
def test_the_torque_may_exceed_that_of_the_best_state_by_a_tenth(torque_Nm: float, verdict: str) -> None:
    found = compared(braking(torque_Nm), braking(120.0), braking(48.0), braking(90.0))
    assert found["verdict"] == verdict


@pytest.mark.parametrize(("amperes", "verdict"), [(500.0, MET), (659.0, PHYSICS), (661.0, OPEN)])
def test_the_current_may_exceed_that_of_the_best_state_by_a_tenth(amperes: float, verdict: str) -> None:
    found = compared(braking(0.0, amperes), braking(120.0), braking(0.0, 600.0), braking(0.0, 700.0))
    assert found["verdict"] == verdict


def test_where_a_state_holds_the_limits_with_the_margin_the_run_must_hold_them() -> None:
    assert compared(braking(10.5), braking(9.0), braking(48.0), braking(48.0))["verdict"] == OPEN


def test_less_torque_is_no_excuse_for_a_voltage_that_destroys_the_inverter() -> None:
    """Switching disabled would be best, but leaves 600 V of 450: the short circuit with 48 N·m is the reference."""
    destroyed = braking(15.0, volts=600.0)
    assert compared(braking(50.0), destroyed, braking(48.0), braking(90.0))["reference"] == LOWER
    assert (
        compared(braking(50.0), destroyed, braking(48.0, volts=500.0), braking(90.0, volts=500.0))["reference"] == OFF
    )


@pytest.mark.parametrize(
    "run",
    [
        braking(50.0, fault_ms=12.0),
        braking(50.0, fault_ms=math.inf),
        braking(50.0, volts=451.0),
        trace(torque=lambda t: np.where(t < 150, 0.0, np.nan), amperes=501.0),
    ],
)
def test_a_late_fault_or_too_much_voltage_is_never_excused(run: Trace) -> None:
    states = States(*[braking(100.0, 900.0)] * 3)
    found = evaluate(row(), BOUNDS, 132.0, POINT, run, states.reruns)
    assert (found["verdict"], found["reference"], states.entered) == (OPEN, "", [])


def test_a_healthy_drive_that_must_keep_its_torque_is_never_excused() -> None:
    steady = trace(fault_ms=math.inf, state=RUN, torque=lambda t: np.where(t < 0, 60.0, 80.0))
    line = {"reaction": "keep", "expected": "", "torque_Nm": "3", "torque_ms": "0"}
    assert compared(steady, *[braking(100.0, 900.0)] * 3, **line)["verdict"] == OPEN


def test_the_states_begin_with_the_drives_reaction_at_the_latest_when_the_line_demands_it() -> None:
    states = States(*[braking(100.0, 900.0)] * 3)
    evaluate(row(), BOUNDS, 132.0, POINT, braking(50.0), states.reruns)
    assert states.entered == [pytest.approx(5.0, abs=0.2)] * 3
    late = braking(0.0, 600.0, fault_ms=20.0, torque=lambda t: np.where(t < 20.0, 60.0, 0.0))
    states.entered.clear()
    evaluate(row(reaction="bounded"), BOUNDS, 132.0, POINT, late, states.reruns)
    assert states.entered == [10.0] * 3


def late(effect_ms: float, **cells: str) -> dict[str, Any]:
    """A fault after 100 ms; until its effect the run is the healthy one."""
    healthy = trace(fault_ms=math.inf, torque=lambda t: 60.0 + np.sin(t))
    run = trace(100.0, lambda t: np.where(t < 100.0, 60.0 + np.sin(t) - 30.0 * (t > effect_ms), 0.0))
    return evaluate(row(**cells), BOUNDS, 132.0, POINT, run, States(*[run] * 3, healthy).reruns)


def test_a_fault_without_effect_cannot_be_found_before_it_has_one() -> None:
    """Demanded within 10 ms."""
    found = late(92.0)
    assert (found["verdict"], found["effect_ms"]) == (PHYSICS, pytest.approx(92.0, abs=0.15))
    assert "no effect before 92.0 ms" in found["why"]
    assert late(88.0)["verdict"] == OPEN
    assert late(0.0)["verdict"] == OPEN
    assert late(math.inf, expected="over_speed")["verdict"] == OPEN


def test_too_little_torque_is_allowed_where_the_line_says_so_and_too_much_is_not() -> None:
    line = row(reaction="less", expected="any", detect_ms="", torque_ms="")
    assert verdict(line, trace(fault_ms=math.inf, torque=lambda t: np.where(t < 0, 60.0, 20.0)))["met"]
    assert verdict(line, trace())["met"]
    assert not verdict(line, trace(fault_ms=math.inf, torque=lambda t: np.where(t < 0, 60.0, 71.0)))["met"]
    assert not verdict(line, trace(fault_ms=math.inf, torque=lambda t: np.where(t < 0, 60.0, -11.0)))["met"]


# A bit that nothing reads, one that moves the torque by less than 1 N·m, one that moves it for 10 ms within its
# tolerance, and one that the drive finds.
@pytest.mark.parametrize(
    ("run", "found"),
    [
        ({"fault_ms": math.inf, "torque": lambda t: np.full(t.shape, 60.0)}, NO_EFFECT),
        ({"fault_ms": math.inf, "torque": lambda t: 60.0 + 0.9 * (t > 0.0)}, NO_EFFECT),
        ({"fault_ms": math.inf, "torque": lambda t: 60.0 - 5.0 * ((t > 0.0) & (t < 10.0))}, MET),
        ({"fault_ms": 5.0}, MET),
    ],
)
def test_a_change_of_the_memory_that_nothing_notices_has_no_effect(run: dict[str, Any], found: str) -> None:
    healthy = trace(fault_ms=math.inf, torque=lambda t: np.full(t.shape, 60.0))
    states = States(*[healthy] * 3, healthy=healthy)
    line = row(injection="memory.drive.unused=^1", reaction="bounded", expected="any")
    found_run = evaluate(line, BOUNDS, 132.0, POINT, trace(**run), states.reruns)
    assert (found_run["verdict"], found_run["met"]) == (found, found == MET)


def test_where_no_fault_is_demanded_nothing_needs_to_happen() -> None:
    steady = trace(fault_ms=math.inf, state=RUN, torque=lambda t: np.full(t.shape, 60.0))
    for cells in ({"injection": "memory.board.broken=1", "reaction": "keep", "expected": ""}, {"reaction": "bounded"}):
        assert evaluate(row(**cells), BOUNDS, 132.0, POINT, steady, States(*[steady] * 3).reruns)["verdict"] == MET


def scored(*verdicts: str, status: str = MET, is_host: bool = True) -> Score:
    """A line of which each run has one of these verdicts."""
    line = row(injection="memory.drive.unused=^1", status=status)
    runs = [verdict(line, trace()) | {"verdict": each, "met": each in (MET, PHYSICS)} for each in verdicts]
    return score((line,), pd.DataFrame(runs), is_host)[0]


def test_a_line_that_never_has_an_effect_is_open_and_no_status_is_true_of_it() -> None:
    for status in (MET, PHYSICS, OPEN):
        never = scored(NO_EFFECT, NO_EFFECT, status=status)
        assert (never.status, never.is_true) == (OPEN, False)
        assert "WITHOUT EFFECT" in never.result
    assert scored(NO_EFFECT, NO_EFFECT, is_host=False).is_true
    some = scored(MET, NO_EFFECT, NO_EFFECT)
    assert (some.status, some.is_true, some.met, some.idle) == (MET, True, 1, 2)
    assert "2 of 3 runs without effect" in some.result
    assert scored(OPEN, NO_EFFECT).status == OPEN
    assert "1 of 2 runs not met" in scored(OPEN, NO_EFFECT).result


def test_runs_without_effect_are_not_counted_as_demanded() -> None:
    one = scored(MET, NO_EFFECT, NO_EFFECT, OPEN)
    table = pd.DataFrame({"row": ["a-line"] * 4, "verdict": [MET, NO_EFFECT, NO_EFFECT, OPEN], "first_fault": [""] * 4,
                          "met": [True, False, False, False], "effect_ms": [math.nan] * 4})  # fmt: skip
    summary = summarise([one], table)
    assert (summary.runs, summary.runs_met, summary.runs_idle, summary.share) == (4, 1, 2, 50.0)


@pytest.mark.parametrize(
    ("cells", "said"),
    [
        ({"id": "A line"}, "id = 'A line', allowed: lower-case words joined by -"),
        ({"reaction": "hope"}, "reaction = 'hope', allowed: safe_state, bounded, less, keep, ramp"),
        ({"expected": ""}, "expected = '', allowed: names of faults"),
        ({"injection": "plant.vdc_gain"}, "injection = 'plant.vdc_gain', allowed: name=value"),
        ({"points": "rpm=5"}, "points = 'rpm=5', allowed: conditions such as"),
        ({"detect_ms": "-1"}, "detect_ms = '-1', allowed: a number from 0"),
        ({"status": "fine"}, "status = 'fine', allowed: met, physics, open"),
    ],
)
def test_a_bad_cell_is_named_with_its_line(cells: dict[str, str], said: str) -> None:
    with pytest.raises(FluxtrueError) as refusal:
        fmea.parse(text(**cells), "t.csv")
    assert str(refusal.value).startswith(f"t.csv: line 2: {said}")


def test_steps_change_values_as_they_say() -> None:
    steps = row(injection="a=5; b=x0.5@3; c=+2@1..9; d=^6; e=point").injection
    assert [step.applied(4.0, 60.0) for step in steps] == [5.0, 2.0, 6.0, 2.0, 60.0]
    assert [(step.at_ms, step.until_ms) for step in steps] == [(0, 0), (3, 3), (1, 9), (0, 0), (0, 0)]


def test_a_table_is_written_as_it_was_read() -> None:
    assert fmea.write([row()]) == text()


def test_members_of_the_state_are_found_by_their_names() -> None:
    motor = load("hsm1")
    with EcuLoop(motor, {}) as loop:
        loop.power_up()
        assert loop.read("ecu.supervisor.state") == RUN == loop.state
        assert loop.read("drive.fast.faults") == loop.get("fault_word") == 0
        loop.write("board.gate_fault", 1)
        loop.steps(2)
        assert loop.get("fault_word") != 0
        with pytest.raises(FluxtrueError, match="no member 'nothing'"):
            loop.read("drive.nothing")
        with pytest.raises(FluxtrueError, match="not a number"):
            loop.read("drive.fast")
