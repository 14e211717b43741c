/* SPDX-License-Identifier: Apache-2.0 */
#include "ecu/shut_off.h"

#include "ecu/supervisor.h"

#define GONE_US 20000U   /* longest time until a supply that is not required must be absent */
#define ABSENT_US 10000U /* longest time without a supply that is required; its start included */

typedef struct {
    bool on, wrong; /* this stage switches the supply on; gives wrong answers */
    bool supply;    /* the supply that must then be read back */
    uint16_t fault; /* the path's fault if it is not */
} stage_t;

static const stage_t stages[] = {
    {.on = true, .supply = true, .fault = ECU_FAULT_GATE_SUPPLY},
    {.on = false, .supply = false, .fault = ECU_FAULT_GATE_SUPPLY},
    {.on = true, .supply = true, .fault = ECU_FAULT_GATE_SUPPLY},
    {.on = true, .wrong = true, .supply = false, .fault = ECU_FAULT_WATCHDOG},
    {.on = true, .supply = true, .fault = ECU_FAULT_WATCHDOG},
};
#define STAGES (sizeof stages / sizeof stages[0])

static void begin_stage(shut_off_t *state, uint8_t stage)
{
    state->stage = stage;
    state->us = 0;
    state->tested = stage >= STAGES;
    state->supply_on = !state->tested && stages[stage].on;
    state->wrong = !state->tested && stages[stage].wrong;
}

static void end_test(shut_off_t *state, uint16_t failed)
{
    state->failed = failed;
    state->supply_on = false;
    state->wrong = false;
}

static void test_step(shut_off_t *state, const shut_off_in_t *in)
{
    if (state->us == 0U && state->stage == 0U) {
        begin_stage(state, 0);
    }
    const uint32_t us_max = stages[state->stage].supply ? ABSENT_US : GONE_US;
    state->us += in->elapsed_us;
    if (in->switching) {
        end_test(state, ECU_FAULT_GATE_DISABLE);
    } else if (state->us > in->elapsed_us && in->supply == stages[state->stage].supply) {
        begin_stage(state, (uint8_t)(state->stage + 1U));
    } else if (state->us > us_max) {
        end_test(state, stages[state->stage].fault);
    }
}

/* The torque must not return when an absent supply comes back: the absence is latched. */
static uint16_t absent(shut_off_t *state, const shut_off_in_t *in)
{
    const bool missing = in->wanted && !in->supply;
    state->us = missing ? state->us : 0U;
    if (missing && state->us <= ABSENT_US) {
        state->us += in->elapsed_us;
    }
    return (state->us > ABSENT_US) ? (uint16_t)ECU_FAULT_GATE_SUPPLY : (uint16_t)0;
}

void shut_off_step(shut_off_t *state, const shut_off_in_t *in)
{
    if (!in->fitted && state->stage == 0U && state->failed == 0U) { /* once it was found, it stays required */
        state->tested = true;
        return;
    }
    if (!state->tested && state->failed == 0U && in->idle) {
        test_step(state, in);
    }
    state->faults = state->tested ? absent(state, in) : state->failed;
}
