# SPDX-License-Identifier: Apache-2.0
"""No constant of the firmware takes a step of the task for a millisecond, or a period for 100 us.

Numbers with which the firmware counts or filters in steps and periods are generated for the motor
(docs/decisions/010-true-time.md). A number that the firmware defines itself is either a time, which code converts into
steps or microseconds of true time, or a count that is not a time.
"""

import re
from pathlib import Path

import pytest

from fluxtrue_tools.motor.emit_c import motor_tables_c
from fluxtrue_tools.motor.motor import load_motor

ROOT = Path(__file__).resolve().parents[3]
HSM1 = ROOT / "firmware" / "motors" / "hsm1"
SOURCES = sorted(
    path
    for folder in ("firmware", "hal/s32k144", "hal/host", "hal/template")
    for path in (ROOT / folder).rglob("*.[ch]")
    if path.name != "registers.h"
)

# Members of motor_t that depend on the PWM period, on the number of periods per step, and on the length of a step.
PERIOD = {
    "bases.period_s", "bridge_duty",
    "angle_tracker.kp", "angle_tracker.ki_q29", "angle_tracker.pu_to_turn", "angle_tracker.turn_to_pu",
    "parameters.current_control.sigma_q24", "parameters.current_control.drop_gain",
    "parameters.current_control.integral_gain",
    "parameters.current_control.clear_q30",
    "parameters.modulate.dead_time_q16", "parameters.modulate.longest_q31", "parameters.modulate.nearer_rail_q31",
    "monitor.angle_count_max", "mrai.period", "mrai.sinc_gain", "mrai.r_delta_max",
    "identify.sinc_gain", "identify.sigma", "parameters.torque_loop.model_rate",
    "plausibility.ripple_max",
    "plausibility.behind_gain",  # of the gain of current control: (MN-43)
    "angle_tracker.lag_steps", "angle_tracker.stop_periods",
    "torque_monitor.lag_gain",  # half a period of it: (AT-7)
    "torque_monitor.v_noise",  # of the gain of current control: (MN-36)
    "torque_monitor.v_lag",  # of a count of the angle sensor: (MN-41)
    "movement.rate_max", "movement.rate_slew",  # of the imposed angle, per period
    "torque_monitor.v_0", "frozen_angle.v_0", "launch_power.v_1",  # the share of the dead time in a period: (MN-25)
}  # fmt: skip
PERIODS_PER_STEP = {
    "bases.periods_per_step", "commission.periods_per_step", "commission.mean_gain_q31", "identify.mean_gain_q32",
    "identify.limited_noise", "frozen_angle.v_0", "frozen_angle.rate_gain",
    "launch_power.v_1", "launch_power.turn_gain", "launch_power.periods",
}  # fmt: skip
STEP = {
    "bases.step_s", "trim_steps", "parameters.torque_slew", "torque_slew_weak",
    "mrai.psi_drift_full", "mrai.r_drift_full", "mrai.quality_rate",
    "identify.rate_gain_q28", "identify.window_turns_q29", "identify.turn_to_pu", "identify.leak",
    "identify.noise_voltage_q30", "identify.noise_flux_q30", "identify.noise_rate_q30", "identify.local_rate",
    "identify.mismatch_rate", "identify.confidence_rate",
    "parameters.torque_loop.ki", "parameters.torque_loop.model_rate", "voltage_reserve.gain", "torque_limit.loss_rate",
    "plausibility.deviation_steps", "plausibility.ripple_steps", "plausibility.gate_exceeded_steps",
    "plausibility.lost_steps", "plausibility.equal_steps",
    "plausibility.fast_steps", "plausibility.hot_steps", "torque_monitor.rate_gain", "torque_monitor.mean_rate",
    "torque_monitor.lag_gain", "frozen_angle.rate_gain", "launch_power.turn_gain",
    "launch_power.settle_steps", "launch_power.fault_steps",
    "torque_monitor.torque_steps", "torque_monitor.angle_steps",
    "frozen_angle.settle_steps", "frozen_angle.fault_steps", "torque_monitor.settle_steps",
    "commission.settle_steps", "commission.measure_steps", "commission.mean_gain_q31",
    "gate_fault.volt_steps", "movement.i_slew", "movement.blocked_steps", "movement.steps_max",
}  # fmt: skip
# Names of members that are a time, a rate or a count of steps.
TIMED = re.compile(r"_(steps|periods|rate|s|ms|us)$|slew|leak|\.k[ip](_q\d+)?$")
SPEED = re.compile(r"_rad_s$")
# SI for the port; hsm1's torque loop has no proportional part, and its currents follow in one step
TIMED_OTHERWISE = {"dead_time_s", "parameters.torque_loop.kp", "plausibility.answer_rate", "frozen_angle.answer_rate"}
# Times that the firmware defines, and the expression that converts each to true time in every line that uses it.
TIMES = {
    "SETTLED_US": r"settling->us", "STATE_TIME_MAX_US": r"supervisor->us", "SELF_TEST_MS": r"s->us >",
    "SELF_TEST_TIME_OUT_MS": r"is_timed_out\(", "PRECHARGE_TIME_OUT_MS": r"is_timed_out\(",
    "DISCHARGE_TIME_OUT_MS": r"is_timed_out\(",
    "SLEW_MS": r"per_step\(", "JERK_MS": r"per_step\(", "RAMP_OUT_MS": r"per_step\(",
    "COMMAND_TIME_OUT_US": r"has_timed_out\(", "BATTERY_TIME_OUT_US": r"has_timed_out\(",
    "MISMATCH_US": r"state->us", "ABSENT_US": r"state->us|us_max", "GONE_US": r"us_max",
    "EARLY_US": r"since_us", "LATE_US": r"since_us",
    "MEMORY_REST_MS": r"in_steps\(", "MEMORY_INTERVAL_MS": r"in_steps\(",
}  # fmt: skip
# Numbers that are not a time, or not one of the task.
COUNTS = {
    "CONSECUTIVE_MAX": "steps, as docs/howto/can.md says",
    "CONFIRMED_STEPS": "steps, as docs/theory/safe-state.md says",
    "UNKNOWN_STEPS": "steps, as that page says",
    "RECTIFYING_STEPS": "steps, as that page says",
    "RELEASE_STEPS": "steps, as that page says",
    "FALL_SHIFT": "steps of the known dc voltage, as that page says",
    "STEPS": "steps of the switch-off, as that page says",
    "RAMP_STEPS": "steps of its ramp, as that page says",
    "QUIET_STEPS": "steps without current, as that page says",
    "SILENT_STEPS_MAX": "steps without a command, as docs/architecture.md says",
    "GATE_EXCEEDED_MAX": "updates of the identification",
    "LAG_SHIFT": "share of the speed",
    "EXCESS_STEPS": "steps, as docs/theory/torque-loop.md says",
    "SWING_STEPS": "steps of the damping, as docs/theory/commissioning.md says",
    "MOVING_STEPS": "steps, as docs/theory/monitors.md says",
    "EARLY_STEPS": "steps, as that page says",
    "SLOW_STEPS": "steps, as that page says",
    "STANDING_STEPS": "steps, as that page says",
    "NOISE_MAX": "share of a threshold",
    "REFERENCE_STEPS": "steps, as that page says",
    "ZERO_STEPS": "steps, as that page says",
    "MEAN_PERIODS": "periods of a mean of the simulation's own",
    "SCOPE_FREEZE_SAMPLES": "samples around a fault, as docs/howto/scope.md says",
    "SEARCHED_AT_ONCE": "samples between two branches; any number finds the same",
    "FIRST_PER_S": "a rate by the core's clock, before the task runs",
    "VELOCITY_TURNS_PER_S": "the unit in which the converter sends the speed",
    "FAST_ANGLE": "angle of a step, as that page says",
    "RESET_STEPS": "a reset on its way to the drive",
    "DEVIATION_UNLIMITED": "weight of a step against deviation_steps",
    "IDENTIFY_STEPS": "windows of an update, whose rates are generated for its true time",
    "TIME_CONSTANT_SHIFT": "moves of the trim, one each trim_steps",
    "QUARTER": "steps that renew the whole table, as docs/theory/angle-tracker.md says",
    "ADVANCE_MIN": "angle of a step, as that page says",
    "ADVANCE_MAX": "angle of a step, as that page says",
    "ADVANCE_FAST_SHIFT": "angle of a step, as that page says",
    "DIFFERENCE_MAX_SHIFT": "share of that angle",
    "PERIODS_TO_ACT": "delay from duty to voltage",
    "FRAMES_PER_TASK": "frames, more than a bus carries in the longest step",
    "CHECKSUM_MAX": "bytes",
    "FREEZE_FRAME_SAMPLES": "entries, one each millisecond of the clock",
    "XCP_DAQ_EVENTS": "events",
    "TIMESTAMP_MODE": "a code",
    "DEAD_TIME_MAX": "ticks of the timer", "DEAD_TIME_BY_4": "a code", "SAMPLE_PULSE_TICKS": "ticks of the timer",
    "PERIODS_MAX": "periods of the longest step",
    "BURST_PERIODS_MAX": "periods of the longest burst of voltage pulses, an upper bound of what may be asked for",
    "WORDS_PER_STEP": "words, as docs/theory/data-integrity.md says",
    "STEPS_WITHOUT_WINDOW": "steps, as that page says",
    "PER_STEP": "share of an update", "STEP_CLOCK_NOMINAL_NS": "of the clock itself",
    "STEP_1MS": "a step that is exactly 1 ms", "STEP_DC": "of a temperature",
    "APART_STEPS": "steps, as hal/s32k144/README.md says",
    "TEMPERATURE_CYCLE_STEPS": "steps, as that page says", "RETAINED_STEPS": "steps, as docs/theory/safe-state.md says",
    "AWAIT_LOOPS": "loops before there is a task",
    "COMMAND_LOOPS": "loops of the background, longer than any flash command",
    "MEMORY_HOLD_STEPS": "steps in which a save waits for the drive, as firmware/storage/memory.h says",
    "PERIODS_MAX_STEPS": "steps after which the overrun is another fault's",
    "STOPPED_PERIODS": "of a timer that never runs",
    "FIRST_TICKS": "ticks of the watchdog", "TIMEOUT_TICKS": "ticks of the watchdog",
    "WINDOW_TICKS": "ticks of the watchdog",
    "READY_TICKS": "ticks of the timer", "PULSE_TICKS": "ticks of the timer",
    "START_TICKS": "ticks of the timer", "UNTIL_PWM_TICKS": "ticks of the timer",
    "SAMPLING_ANGLE_TICKS": "ticks of the timer", "EXCITATION_FIRST_PER_S": "a rate by the core's clock, at the start",
    "SETTLING_PERIODS": "periods of the excitation, whose filter follows the PWM frequency",
    "LAST_BUT_ONE": "steps of an update, whose rates are generated for its true time",
    "ATTEMPTS": "of a save",
    "SEARCH_PERIODS": "PWM periods in which the currents of a gate fault can show a switch that conducts always",
    "PREDICTION_STEP": "the place of a step among those of an update, whose rates are generated for its true time",
    "SLOTS": "milliseconds of the clock that the frames are sent by",
}  # fmt: skip
DEFINE = re.compile(r"^#define (\w+)\s+\(?-?[0-9].*$", re.MULTILINE)
NAMED = re.compile(r"(_MS|_US|_S|_SAMPLES|_TICKS|_CYCLES|_ROW)$|STEP|PERIODS|CONSECUTIVE|TIME_|_PER_TASK")
UNITS = re.compile(r"_RAD_S$")
TOLD = re.compile(r"\b(steps?|ms|milliseconds?|seconds?|updates?|tasks?)\b")


def members(text: str) -> dict[str, str]:
    """{"plausibility.hot_steps": "110"} of the generated motor_t, and of what the paper's law has beside it."""
    found, path = {}, []
    law, _, rest = text[text.index("const mrai_config_t mrai =") :].partition("};\n")
    lines = [".mrai = {", *law.splitlines()[1:], "}", *rest[rest.index("const motor_t motor") :].splitlines()[1:]]
    for line in lines:
        begun = re.match(r"\s*\.(\w+) = (.*)$", line)
        if begun and begun[2].strip() == "{":
            path.append(begun[1])
        elif begun and begun[2] != "&mrai,":
            found[".".join([*path, begun[1]])] = begun[2].partition("/*")[0].strip().rstrip(",")
        elif line.strip().startswith("}") and path:
            path.pop()
    return found


@pytest.fixture(scope="module")
def at(tmp_path_factory):
    """Members for hsm1 at a frequency, with a full scale that keeps the per-unit bases."""

    def _at(pwm_hz):
        folder = tmp_path_factory.mktemp(f"{pwm_hz:g}")
        text = (HSM1 / "motor.toml").read_text(encoding="utf-8")
        for key, value in (("pwm_hz", pwm_hz), ("current_full_scale_A", 500.0)):
            text = re.sub(rf"^{key} = .*$", f"{key} = {value}", text, flags=re.MULTILINE)
        (folder / "motor.toml").write_text(text.replace('"flux_map.csv"', f'"{HSM1 / "flux_map.csv"}"'))
        return members(motor_tables_c(load_motor(folder)))

    return _at


def changed(a, b):
    assert a.keys() == b.keys() and len(a) > 150
    return {name for name in a if a[name] != b[name]}


def test_twice_the_frequency_with_the_same_step_changes_what_counts_periods_and_nothing_else(at):
    assert changed(at(16000.0), at(32000.0)) == PERIOD | PERIODS_PER_STEP


def test_a_shorter_step_of_as_many_periods_changes_what_counts_steps_too(at):
    """16 periods of 16.4 kHz: 0.976 ms. Every count grows by one or more, but for one of 10 periods: 2.5 % are less."""
    assert changed(at(16000.0), at(16400.0)) == (PERIOD | STEP) - {"angle_tracker.lag_steps"}


def test_every_member_whose_name_promises_a_time_is_among_them(at):
    timed = {name for name in at(16000.0) if TIMED.search(name) and not SPEED.search(name)}
    assert timed - PERIOD - PERIODS_PER_STEP - STEP == TIMED_OTHERWISE


def defined(text: str) -> set[str]:
    """Defined numbers whose name or comment is about time."""
    found = {m[1]: m[0].partition("/*")[2] for m in DEFINE.finditer(text)}
    return {name for name, comment in found.items() if NAMED.search(name) or TOLD.search(comment)}


def test_every_number_that_tells_of_time_or_steps_is_listed_with_what_it_is():
    names = {name for path in SOURCES for name in defined(path.read_text(encoding="utf-8"))}
    assert {name for name in names if not UNITS.search(name)} == TIMES.keys() | COUNTS.keys()


@pytest.mark.parametrize("line", ["#define HOLD_MS 30U", "#define LOST 30U /* ms */", "#define WAIT_STEPS 12",
                                  "#define WAIT 12 /* steps of the task */"])  # fmt: skip
def test_a_new_number_of_time_is_found(line):
    assert len(defined(f"#include <x.h>\n{line}\n#define OTHER 3\n")) == 1


@pytest.mark.parametrize("name", TIMES)
def test_a_time_becomes_true_in_each_line_that_uses_it(name):
    lines = [line for path in SOURCES for line in path.read_text(encoding="utf-8").splitlines()]
    users = [line for line in lines if re.search(rf"\b{name}\b", line) and not re.match(r"#define| \*", line)]
    assert users
    assert all(re.search(TIMES[name], line) for line in users), users
