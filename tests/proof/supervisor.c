/* SPDX-License-Identifier: Apache-2.0 */
/* The state machine, ecu/supervisor, with its real table, and the observer's decision that the machine is slow. Each
 * harness makes one step from any content of the state: what holds there holds in every state that can be reached. */
#include "proof.h"

/* The table first: CBMC takes the size of an array from the declaration that it meets before a use. */
#include "ecu/supervisor_table.c"

#include "ecu/supervisor.c"

#include "ecu/observe.c"
#include "fx/format.c"
#include "fx/q.c"

#define STEP_MAX_US 10000U

/* Returns any value: the harness of the observer does not depend on voltages in volts. */
float si_from_q15(q15_t x, float base)
{
    float any;
    (void)x, (void)base;
    return any;
}

static supervisor_t any_state(void)
{
    supervisor_t s;
    ASSUME(WITHIN((int)s.state, 0, STATES - 1));
    s.enable_seen = nondet_bool();
    s.reset_seen = nondet_bool();
    s.enabled = nondet_bool();
    return s;
}

static supervisor_in_t any_input(void)
{
    supervisor_in_t in;
    in.alive = nondet_bool();
    in.failed = nondet_bool();
    in.torque_mode = nondet_bool();
    in.current_mode = nondet_bool();
    in.enable = nondet_bool();
    in.reset = nondet_bool();
    in.slow = nondet_bool();
    in.dc_in_range = nondet_bool();
    in.dc_settled = nondet_bool();
    in.dc_near_battery = nondet_bool();
    in.dc_contradicts = nondet_bool();
    in.shut_off_tested = nondet_bool();
    ASSUME(in.elapsed_us <= STEP_MAX_US);
    return in;
}

/* Contactor and gate supply are on: the bridge can short-circuit the machine, and the battery absorbs its power. */
static bool holds(ecu_state_t state)
{
    return supervisor_outputs[state].contactor && supervisor_outputs[state].gate_driver;
}

void proof_supply_stays_on_until_slow(void)
{
    supervisor_t s = any_state();
    const supervisor_in_t in = any_input();
    const bool held = holds(s.state);
    supervisor_step(&s, &in);
    PROVE(!held || in.slow || holds(s.state));
}

void proof_switching_only_with_supply(void)
{
    supervisor_t s = any_state();
    const supervisor_in_t in = any_input();
    supervisor_step(&s, &in);
    PROVE(WITHIN((int)s.state, 0, STATES - 1));
    PROVE(!supervisor_outputs[s.state].run || holds(s.state));
    PROVE(!supervisor_outputs[s.state].discharge || !supervisor_outputs[s.state].contactor);
}

void proof_the_contactor_closes_only_when_charged(void)
{
    supervisor_t s = any_state();
    const supervisor_in_t in = any_input();
    const bool closed = supervisor_outputs[s.state].contactor;
    supervisor_step(&s, &in);
    PROVE(closed || !supervisor_outputs[s.state].contactor || (in.dc_in_range && in.dc_settled && in.dc_near_battery));
}

void proof_slow_is_below_the_dc_link(void)
{
    motor_t m;
    drive_t drive;
    ASSUME(IS_MAGNITUDE(m.monitor.v_min));
    drive.motor = &m;
    drive.task.gate_fault.holds_supply = nondet_bool();
    const q15_t line_emf = drive.task.safe_state.line_emf;
    /* line_emf < 0.8 v_min, within the rounding of one product. */
    if (is_slow(&drive)) {
        PROVE(!drive.task.gate_fault.holds_supply);
        PROVE((int32_t)line_emf * 32768 <= Q15(0.8) * (q15_t)m.monitor.v_min);
    }
}

void proof_a_trip_ends_switching(void)
{
    supervisor_t s = any_state();
    const supervisor_in_t in = any_input();
    supervisor_step(&s, &in);
    PROVE(in.drive_faults == 0U || !supervisor_outputs[s.state].run);
    PROVE(!in.gate_fault || !supervisor_outputs[s.state].run);
    PROVE((in.shut_off_faults & SHUT_OFF_FAULTS) == 0U || !supervisor_outputs[s.state].run);
}

void proof_enable_is_granted_only_when_ready(void)
{
    supervisor_t s = any_state();
    const supervisor_in_t in = any_input();
    const supervisor_t before = s;
    supervisor_step(&s, &in);
    if (!before.enabled && s.enabled) {
        PROVE(before.state == STATE_READY && in.alive && in.enable && !before.enable_seen);
        PROVE(in.torque_mode && !in.current_mode && in.dc_in_range && in.sensors_plausible);
        PROVE(in.angle_absolute || in.angle_imposed);
        PROVE(in.torque_requested_is_zero && in.drive_faults == 0U && s.faults == 0U);
    }
    if (!supervisor_outputs[before.state].run && supervisor_outputs[s.state].run) {
        PROVE(before.state == STATE_READY && s.enabled && in.drive_faults == 0U && s.faults == 0U);
    }
}

void proof_a_lost_command_disables(void)
{
    supervisor_t s = any_state();
    const supervisor_in_t in = any_input();
    supervisor_step(&s, &in);
    PROVE((in.alive && in.enable && in.torque_mode) || !s.enabled || (in.alive && in.enable && !s.enable_seen));
    PROVE(in.alive || (!s.enabled && s.enable_seen));
}

void proof_faults_stay_until_a_reset(void)
{
    supervisor_t s = any_state();
    const supervisor_in_t in = any_input();
    const supervisor_t before = s;
    supervisor_step(&s, &in);
    const bool reset = before.state == STATE_FAULT && in.alive && in.reset && !before.reset_seen && !in.enable;
    PROVE(reset || (before.faults & ~s.faults) == 0);
    PROVE((s.resets != before.resets) == reset);
    PROVE(!in.failed || (s.faults & ECU_FAULT_PROTECTION) != 0);
    PROVE(!in.stalled || (s.faults & ECU_FAULT_STALL) != 0);
    PROVE(!in.dc_contradicts || (s.faults & ECU_FAULT_BATTERY_VOLTAGE) != 0);
    PROVE(!in.task_late || (s.faults & ECU_FAULT_TASK) != 0);
}

void proof_a_fault_leaves_by_reset_or_discharge(void)
{
    supervisor_t s = any_state();
    const supervisor_in_t in = any_input();
    const supervisor_t before = s;
    supervisor_step(&s, &in);
    if (before.state == STATE_FAULT && s.state != STATE_FAULT) {
        PROVE((s.faults == 0U && in.drive_faults == 0U) || s.state == STATE_DISCHARGE);
    }
}

void proof_precharge_ends_in_time(void)
{
    supervisor_t s = any_state();
    const supervisor_in_t in = any_input();
    ASSUME(s.us <= STATE_TIME_MAX_US + STEP_MAX_US);
    const supervisor_t before = s;
    supervisor_step(&s, &in);
    PROVE(s.us <= STATE_TIME_MAX_US + STEP_MAX_US);
    PROVE(s.state != STATE_PRECHARGE || before.state == STATE_PRECHARGE || in.shut_off_tested);
    if (before.us > PRECHARGE_TIME_OUT_MS * 1000U && before.state == STATE_PRECHARGE) {
        PROVE(s.state == STATE_FAULT);
    }
    if (before.us > DISCHARGE_TIME_OUT_MS * 1000U && before.state == STATE_DISCHARGE) {
        PROVE((s.faults & ECU_FAULT_DISCHARGE) != 0 && s.state == STATE_FAULT);
    }
}

void proof_self_test_comes_first(void)
{
    supervisor_t s = any_state();
    const supervisor_in_t in = any_input();
    const supervisor_t before = s;
    supervisor_step(&s, &in);
    if (before.state == STATE_INIT && s.state != STATE_INIT && s.state != STATE_FAULT) {
        PROVE(in.sensors_plausible && in.shut_off_tested && (uint64_t)before.us + in.elapsed_us > SELF_TEST_MS * 1000U);
    }
}

void proof_first_fault_is_named(void)
{
    supervisor_t s = any_state();
    const supervisor_in_t in = any_input();
    ASSUME(s.first_fault < FIRST_ECU_FAULT + 16U);
    const supervisor_t before = s;
    supervisor_step(&s, &in);
    PROVE(s.first_fault < FIRST_ECU_FAULT + 16U);
    PROVE(s.first_fault == 0U || s.first_fault == before.first_fault || before.first_fault == 0U ||
          s.resets != before.resets);
    PROVE(s.fault_count >= before.fault_count);
}
