/* SPDX-License-Identifier: Apache-2.0 */
#include "hal/host/external_watchdog.h"

#define EARLY_US 400.0
#define LATE_US 3000.0
#define ERRORS_OFF 3
#define ERRORS_MAX 6

/* (QA-1): nine points, each after one rotation to the right. */
static uint32_t first_level(uint32_t question)
{
    uint64_t s = question;
    for (uint64_t n = 1; n <= 9; n++) {
        const uint64_t odd = s % 2U;
        s = (s / 2U + odd * 0x80000000ULL) ^ (n * 0x9E3779B1ULL % 0x100000000ULL);
    }
    return (uint32_t)s;
}

/* (QA-2): three parts, 0x51 ... 0x53. */
static uint32_t second_level(uint32_t question)
{
    uint64_t s = question;
    for (uint64_t part = 0x51; part <= 0x53; part++) {
        s = (s ^ part) * 16777619ULL % 0x100000000ULL;
    }
    return (uint32_t)s;
}

void external_watchdog_start(external_watchdog_t *device)
{
    *device = (external_watchdog_t){.question = 1, .errors = 1};
}

static void err(external_watchdog_t *device)
{
    device->errors = (uint8_t)(device->errors < ERRORS_MAX ? device->errors + 1 : ERRORS_MAX);
    if (device->errors >= ERRORS_OFF && !device->does_not_switch_off) {
        device->switched_on = false;
    }
}

void external_watchdog_pass(external_watchdog_t *device, double us)
{
    device->since_us += us;
    if (device->since_us > LATE_US) {
        device->since_us = 0.0;
        err(device);
    }
}

/* The next question from a shift register of four bits, 15 states: never 0, never the same twice in a row. */
void external_watchdog_answer(external_watchdog_t *device, uint32_t answer)
{
    const uint32_t q = device->question;
    const bool right = answer == (first_level(q) ^ second_level(q)) && device->since_us >= EARLY_US;
    device->since_us = 0.0;
    if (!right) {
        err(device);
        return;
    }
    device->question = (uint8_t)((q << 1 & 15U) | ((q >> 3 ^ q >> 2) & 1U));
    device->errors = (uint8_t)(device->errors > 0 ? device->errors - 1 : 0);
    device->switched_on = device->switched_on || device->errors == 0;
}

bool external_watchdog_supply(const external_watchdog_t *device, bool board_on)
{
    return (board_on || device->supply_does_not_stop) && device->switched_on;
}
