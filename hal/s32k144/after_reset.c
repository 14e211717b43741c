/* SPDX-License-Identifier: Apache-2.0 */
#include "hal/s32k144/after_reset.h"

#include "drive/after_reset.h"
#include "hal/s32k144/angle.h"
#include "hal/s32k144/clock.h"
#include "hal/s32k144/pins.h"
#include "hal/s32k144/registers.h"
#include "hal/s32k144/retained.h"
#include "hal/s32k144/sampling.h"
#include "types/si.h"

#define TWO_PI 6.2831853F
#define KEPT_LINES ((1U << PIN_MAIN_CONTACTOR) | (1U << PIN_GATE_DRIVER))

static retained_t retained; /* start-up: what the last run left; then: what this one has written last */
static uint32_t steps;
static q15_t speed; /* measured, negative: not known; start-up only */

static q15_t measured_speed(void)
{
    const float turns_per_s = angle_first_speed();
    const float omega = TWO_PI * (float)motor.angle_tracker.pole_pairs * turns_per_s;
    return (turns_per_s < 0.0F) ? (q15_t)-1 : q15_from_si(omega, motor.bases.omega_rad_s);
}

static q15_t measured_v_dc(void)
{
    sampling_first_end();
    return after_reset_v_dc(&motor, sampling_first_v_dc());
}

/* A dc link that has lost an eighth of its voltage was without its battery for longer than a contactor takes to open:
 * it must be precharged. */
static bool is_link_charged(q15_t v_dc)
{
    return 8 * v_dc >= 7 * retained.drive.v_dc;
}

bool after_reset_begin(const pwm_config_t *pwm)
{
    if (!retained_read(&retained) || !retained.drive.armed) {
        return false;
    }
    clock_first();
    pins_init();
    pwm_init(pwm);
    sampling_first_begin();
    speed = measured_speed();
    const q15_t v_dc = measured_v_dc();
    if (!after_reset_needs_short_circuit(&motor, &retained.drive, speed, v_dc) || !is_link_charged(v_dc)) {
        return false;
    }
    PTC->PSOR = retained.lines & KEPT_LINES;
    pwm_hold_short_circuit();
    pins_offer_bridge();
    pins_keep_bridge(true);
    return true;
}

void after_reset_continue(drive_t *drive)
{
    after_reset_hold(drive, &retained.drive, speed);
}

void after_reset_note(const drive_t *drive)
{
    retained_t now = {.lines = PTC->PDIR & KEPT_LINES};
    before_reset(drive, &now.drive);
    steps++;
    if (retained_is_due(&now, &retained, steps)) {
        retained = now;
        retained_write(&now);
    }
}
