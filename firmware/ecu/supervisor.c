/* SPDX-License-Identifier: Apache-2.0 */
#include "ecu/supervisor.h"

#include "signal/counter.h"

#define SELF_TEST_MS 50U         /* minimum time in init */
#define SELF_TEST_TIME_OUT_MS 500U
#define PRECHARGE_TIME_OUT_MS 2000U
#define DISCHARGE_TIME_OUT_MS 5000U
#define RESET_STEPS 3U /* until the drive has carried out a reset */
#define STATE_TIME_MAX_US 60000000U /* far beyond every time-out */
#define FIRST_ECU_FAULT 33U
#define SHUT_OFF_FAULTS (ECU_FAULT_GATE_DISABLE | ECU_FAULT_GATE_SUPPLY | ECU_FAULT_WATCHDOG)
#define TRIP_FAULTS (ECU_FAULT_GATE | ECU_FAULT_STALL | SHUT_OFF_FAULTS)

static bool refuse(supervisor_t *s, refused_t reason)
{
    s->refused = reason;
    s->refused_count = (uint8_t)count_up_to(s->refused_count, UINT8_MAX);
    return false;
}

/* The conditions of enable that depend on measured values and on the request. */
static bool grant_by_values(supervisor_t *s, const supervisor_in_t *in)
{
    if (!in->dc_in_range) {
        return refuse(s, REFUSED_DC_VOLTAGE_OUT_OF_RANGE);
    }
    if (!in->sensors_plausible) {
        return refuse(s, REFUSED_SENSOR_IMPLAUSIBLE);
    }
    if (!in->angle_absolute && !in->angle_imposed) {
        return refuse(s, REFUSED_ANGLE_NOT_ABSOLUTE);
    }
    if (in->movement_ended) {
        return refuse(s, REFUSED_MOVEMENT_ENDED);
    }
    if (!in->torque_requested_is_zero) {
        return refuse(s, REFUSED_TORQUE_REQUEST_NOT_ZERO);
    }
    s->refused = REFUSED_NONE;
    return true;
}

/* Whether a rising edge of enable enables switching; if not, the reason is recorded. */
static bool grant_enable(supervisor_t *s, const supervisor_in_t *in)
{
    if (in->current_mode) {
        return refuse(s, REFUSED_MODE_LOCKED);
    }
    if (s->faults != 0U || in->drive_faults != 0U) {
        return refuse(s, REFUSED_FAULT);
    }
    if (s->state != STATE_READY || !in->torque_mode) {
        return refuse(s, REFUSED_NOT_READY);
    }
    return grant_by_values(s, in);
}

static void follow_enable(supervisor_t *s, const supervisor_in_t *in)
{
    if (!in->alive) {
        if (s->enabled) {
            (void)refuse(s, REFUSED_COMMAND_TIMED_OUT);
        }
        s->enabled = false;
        s->enable_seen = true; /* after a time-out a command with enable off must come first */
        return;
    }
    if (in->movement_ended && s->enabled) {
        s->enabled = refuse(s, REFUSED_MOVEMENT_ENDED);
    }
    if (in->enable && !s->enable_seen) {
        s->enabled = grant_enable(s, in);
    } else if (!in->enable || !in->torque_mode) {
        s->enabled = false;
    }
    s->enable_seen = in->enable;
}

static uint32_t bit_if(bool condition, uint32_t bit)
{
    return condition ? bit : 0U;
}

static bool is_timed_out(const supervisor_t *s, ecu_state_t state, uint32_t max_ms)
{
    return s->state == state && s->us > max_ms * 1000U;
}

static bool is_settled_in_range(const supervisor_in_t *in)
{
    return in->dc_in_range && in->dc_settled;
}

/* A dc link that has settled at a voltage that is not the battery's is reported as such, not as a slow precharge. */
static uint32_t precharge_fault(const supervisor_t *s, const supervisor_in_t *in)
{
    const bool elsewhere = is_settled_in_range(in) && !in->dc_near_battery;
    const ecu_fault_t fault = elsewhere ? ECU_FAULT_BATTERY_VOLTAGE : ECU_FAULT_PRECHARGE;
    return bit_if(is_timed_out(s, STATE_PRECHARGE, PRECHARGE_TIME_OUT_MS), fault);
}

static uint16_t present_faults(const supervisor_t *s, const supervisor_in_t *in)
{
    const uint32_t now = bit_if(in->failed, ECU_FAULT_PROTECTION) | bit_if(in->gate_fault, ECU_FAULT_GATE) |
                         bit_if(in->task_late, ECU_FAULT_TASK) | bit_if(in->stalled, ECU_FAULT_STALL) |
                         bit_if(is_timed_out(s, STATE_INIT, SELF_TEST_TIME_OUT_MS), ECU_FAULT_SELF_TEST) |
                         bit_if(in->dc_contradicts, ECU_FAULT_BATTERY_VOLTAGE) | precharge_fault(s, in) |
                         bit_if(is_timed_out(s, STATE_DISCHARGE, DISCHARGE_TIME_OUT_MS), ECU_FAULT_DISCHARGE);
    return (uint16_t)(now | in->shut_off_faults);
}

static uint8_t lowest_bit(uint32_t bits)
{
    uint8_t bit = 0;
    for (; (bits & 1U) == 0U; bits >>= 1) {
        bit++;
    }
    return bit;
}

/* Records new faults. Of several in one step the lowest bit of the drive counts as the first. */
static void record_new_faults(supervisor_t *s, uint32_t new_drive, uint32_t new_ecu)
{
    if (new_drive == 0U && new_ecu == 0U) {
        return;
    }
    s->fault_count = (uint8_t)count_up_to(s->fault_count, UINT8_MAX);
    if (s->first_fault == 0U) {
        s->first_fault = (uint8_t)((new_drive != 0U) ? 1U + lowest_bit(new_drive)
                                                     : FIRST_ECU_FAULT + lowest_bit(new_ecu));
    }
}

static void latch_faults(supervisor_t *s, const supervisor_in_t *in)
{
    const uint16_t now = present_faults(s, in);
    const bool reset_pending = s->reset_pending > 0U;
    record_new_faults(s, reset_pending ? 0U : in->drive_faults & ~s->drive_faults_seen, now & ~(uint32_t)s->faults);
    s->drive_faults_seen = reset_pending ? 0U : in->drive_faults;
    s->reset_pending = reset_pending ? (uint8_t)(s->reset_pending - 1U) : (uint8_t)0;
    s->faults = (uint16_t)(s->faults | now);
}

static void follow_reset(supervisor_t *s, const supervisor_in_t *in)
{
    const bool edge = in->alive && in->reset && !s->reset_seen;
    s->reset_seen = in->alive && in->reset;
    if (!edge) {
        return;
    }
    if (in->enable || s->state != STATE_FAULT) {
        (void)refuse(s, REFUSED_RESET_WHILE_ENABLED);
        return;
    }
    s->resets++;
    s->faults = 0; /* a fault that is still present is latched again as a new one */
    s->first_fault = 0;
    s->reset_pending = RESET_STEPS;
}

static bool has_passed_self_test(const supervisor_t *s, const supervisor_in_t *in)
{
    return in->sensors_plausible && in->shut_off_tested && s->us > SELF_TEST_MS * 1000U;
}

/* The dc link is charged only after the shut-off paths have been tested, also if a fault has ended the start. */
static bool is_on(const supervisor_in_t *in)
{
    return in->alive && in->torque_mode && in->shut_off_tested;
}

static uint32_t conditions(const supervisor_t *s, const supervisor_in_t *in)
{
    const bool faulted = s->faults != 0U || in->drive_faults != 0U;
    const bool tripped = in->drive_faults != 0U || (s->faults & TRIP_FAULTS) != 0U;
    const bool may_discharge = !in->dc_safe && (s->faults & ECU_FAULT_DISCHARGE) == 0U;
    return bit_if(has_passed_self_test(s, in), WHEN_SELF_TEST_PASSED) | bit_if(tripped, WHEN_TRIPPED) |
           bit_if(faulted, WHEN_FAULTED) | bit_if(!faulted, WHEN_HEALTHY) | bit_if(is_on(in), WHEN_ON) |
           bit_if(in->alive && !in->torque_mode && !in->current_mode, WHEN_OFF) |
           bit_if(is_settled_in_range(in) && in->dc_near_battery, WHEN_CHARGED) | bit_if(in->dc_safe, WHEN_DISCHARGED) |
           bit_if(may_discharge, WHEN_NOT_DISCHARGED) | bit_if(s->enabled, WHEN_ENABLED) |
           bit_if(!s->enabled && in->torque_arbitrated_is_zero, WHEN_STOPPED) |
           bit_if(in->torque_arbitrated_is_zero, WHEN_NO_TORQUE) | bit_if(in->derated, WHEN_DERATED) |
           bit_if(!in->derated, WHEN_FULL) | bit_if(in->slow, WHEN_SLOW) |
           bit_if((s->faults & ECU_FAULT_DISCHARGE) != 0U, WHEN_DISCHARGE_FAILED);
}

static void take_transition(supervisor_t *s, uint32_t now)
{
    const uint8_t *first = &supervisor_first[s->state]; /* behind it the first row of the next state */
    for (uint32_t n = first[0]; n < first[1]; n++) {
        const transition_t *row = &supervisor_table[n];
        if ((row->when & now) == row->when) {
            s->state = row->to;
            s->us = 0;
            return;
        }
    }
}

void supervisor_step(supervisor_t *supervisor, const supervisor_in_t *in)
{
    supervisor->us += (supervisor->us < STATE_TIME_MAX_US) ? in->elapsed_us : 0U;
    follow_reset(supervisor, in);
    latch_faults(supervisor, in);
    follow_enable(supervisor, in);
    take_transition(supervisor, conditions(supervisor, in));
    if (!supervisor_outputs[supervisor->state].run && supervisor->state != STATE_READY) {
        supervisor->enabled = false;
    }
}
