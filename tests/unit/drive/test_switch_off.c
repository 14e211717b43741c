/* SPDX-License-Identifier: Apache-2.0 */
/* Which steps hold the torque at zero or move the currents to those of the short circuit, and with which references. */
#include "drive/switch_off.h"

#include "hal/mock_adc.h"
#include "hal/mock_angle.h"
#include "hal/mock_irq.h"
#include "hal/mock_pwm.h"
#include "hal/mock_temperature.h"
#include "seam.h"
#include "types/faults.h"
#include "unity.h"

static snapshot_t snapshot;
static uint32_t faults;

/* Running at a speed at which disabled switching would rectify. */
void setUp(void)
{
    seam_start();
    snapshot = (snapshot_t){.winding_dC = 250};
    faults = 0;
    drive.task.run_state = RUN_STATE_RUN;
    drive.task.safe_state.rectifies = true;
    drive.task.safe_state.short_circuit = true;
    drive.task.i_ref = (dq_q15_t){-800, 1600};
}

void tearDown(void)
{
}

static run_state_t step(run_state_t wanted)
{
    return switch_off_step(&drive, &snapshot, wanted, &faults);
}

void test_enable_off_is_held_only_at_speed_and_without_a_fault(void)
{
    TEST_ASSERT_EQUAL_INT(RUN_STATE_RUN, step(RUN_STATE_OFF));
    TEST_ASSERT_TRUE(switch_off_holds(&drive));
    TEST_ASSERT_FALSE(switch_off_runs(&drive));
    TEST_ASSERT_EQUAL_INT(RUN_STATE_RUN, step(RUN_STATE_RUN));
    TEST_ASSERT_FALSE(switch_off_holds(&drive));
    for (int k = 0; k < 4; k++) {
        setUp();
        drive.task.run_state = (k == 0) ? RUN_STATE_OFF : RUN_STATE_RUN;
        drive.task.safe_state.rectifies = k != 1;
        drive.request.current_mode = k == 2;
        faults = (k == 3) ? FAULT_TORQUE : 0U;
        TEST_ASSERT_EQUAL_INT(RUN_STATE_OFF, step(RUN_STATE_OFF));
        TEST_ASSERT_FALSE(switch_off_holds(&drive));
    }
}

/* A vehicle that rolls faster and faster in state ready. */
void test_holding_begins_with_switching_disabled_where_it_may(void)
{
    for (int k = 0; k < 7; k++) {
        setUp();
        drive.task.run_state = RUN_STATE_OFF;
        drive.request.may_hold = k != 1;
        drive.task.safe_state.rectifies = k != 2;
        snapshot.angle_absolute = k != 3;
        drive.held = k == 4;
        drive.request.current_mode = k == 5;
        faults = (k == 6) ? FAULT_TORQUE : 0U;
        TEST_ASSERT_EQUAL_INT((k == 0) ? RUN_STATE_RUN : RUN_STATE_OFF, step(RUN_STATE_OFF));
        TEST_ASSERT_EQUAL_INT(k == 0, switch_off_holds(&drive));
    }
    setUp(); /* there are no currents to move to the short circuit, and i_ref is an old one */
    drive.task.run_state = RUN_STATE_OFF;
    drive.request.may_hold = true;
    snapshot.angle_absolute = true;
    faults = FAULT_TEMPERATURE;
    TEST_ASSERT_EQUAL_INT(RUN_STATE_OFF, step(RUN_STATE_OFF));
    TEST_ASSERT_FALSE(switch_off_runs(&drive));
    TEST_ASSERT_EQUAL_HEX32(FAULT_TEMPERATURE, faults);
    setUp();
    drive.task.run_state = RUN_STATE_FAULT;
    drive.request.may_hold = true;
    snapshot.angle_absolute = true;
    TEST_ASSERT_EQUAL_INT(RUN_STATE_FAULT, step(RUN_STATE_FAULT));
}

void test_only_faults_that_leave_control_intact_are_kept_back(void)
{
    static const struct {
        uint32_t faults;
        run_state_t wanted;
        bool moves;
    } cases[] = {{FAULT_TEMPERATURE, RUN_STATE_RUN, true},
                 {FAULT_OVER_SPEED, RUN_STATE_OFF, true},
                 {FAULT_TEMPERATURE | FAULT_OVER_SPEED, RUN_STATE_RUN, true},
                 {FAULT_TEMPERATURE | FAULT_TORQUE, RUN_STATE_RUN, false},
                 {FAULT_TEMPERATURE, RUN_STATE_FAULT, false},
                 {0, RUN_STATE_RUN, false}};
    for (unsigned n = 0; n < sizeof cases / sizeof cases[0]; n++) {
        setUp();
        faults = cases[n].faults;
        TEST_ASSERT_EQUAL_INT(cases[n].moves ? RUN_STATE_RUN : cases[n].wanted, step(cases[n].wanted));
        TEST_ASSERT_EQUAL_HEX32(cases[n].moves ? 0U : cases[n].faults, faults);
        TEST_ASSERT_EQUAL(cases[n].moves, switch_off_runs(&drive));
    }
}

/* Between the two levels a fault disables switching, for which no currents need to be moved; torque that is not wanted
 * any more is still held at zero there, because the diodes would conduct. */
void test_where_a_fault_disables_switching_it_is_not_kept_back(void)
{
    drive.task.safe_state.short_circuit = false;
    TEST_ASSERT_EQUAL_INT(RUN_STATE_RUN, step(RUN_STATE_OFF));
    TEST_ASSERT_TRUE(switch_off_holds(&drive));
    faults = FAULT_TEMPERATURE;
    TEST_ASSERT_EQUAL_INT(RUN_STATE_OFF, step(RUN_STATE_OFF));
    TEST_ASSERT_EQUAL_HEX32(FAULT_TEMPERATURE, faults);
}

/* An eighth of the way in each of 8 steps, then 2 with the currents of the short circuit; the fault of the 11th step
 * is passed on. */
void test_the_currents_are_moved_in_8_steps_and_kept_for_2(void)
{
    for (int n = 1; n <= 10; n++) {
        faults = FAULT_TEMPERATURE;
        TEST_ASSERT_EQUAL_INT(RUN_STATE_RUN, step(RUN_STATE_RUN));
        TEST_ASSERT_EQUAL_HEX32(0, faults);
        drive.task.switch_off.i_d = (n == 1) ? -8800 : drive.task.switch_off.i_d;
        const dq_q15_t i_ref = switch_off_reference(&drive);
        const int done = (n < 8) ? n : 8;
        TEST_ASSERT_EQUAL_INT32(-800 - 1000 * done, i_ref.d);
        TEST_ASSERT_EQUAL_INT32(1600 - 200 * done, i_ref.q);
        drive.task.i_ref = i_ref; /* the reference at the start counts, not the last one */
    }
    faults = FAULT_TEMPERATURE;
    TEST_ASSERT_EQUAL_INT(RUN_STATE_FAULT, step(RUN_STATE_FAULT));
    TEST_ASSERT_EQUAL_HEX32(FAULT_TEMPERATURE, faults);
    TEST_ASSERT_FALSE(switch_off_runs(&drive));
}

/* The fault of the 11th step while the drive is still asked to run. */
void test_the_ramp_is_not_extended_by_a_fault_that_stays(void)
{
    for (int n = 1; n <= 10; n++) {
        faults = FAULT_OVER_SPEED;
        (void)step(RUN_STATE_RUN);
    }
    faults = FAULT_OVER_SPEED;
    (void)step(RUN_STATE_RUN);
    TEST_ASSERT_EQUAL_HEX32(FAULT_OVER_SPEED, faults);
}

/* The smallest i_d whose flux is not below zero, by trying each of them. */
static int32_t tried_i_d(q15_t psi_d_error)
{
    int32_t i_d = -i_d_limit_step(&seam.motor.i_d_limit, psi_d_error, snapshot.winding_dC) + 1;
    while (i_d < 0 && flux_table_step(&seam.motor.flux_table, (dq_q15_t){i_d, 0}).psi_d + psi_d_error < 0) {
        i_d++;
    }
    return i_d;
}

/* Errors of the magnet's flux in steps of 7 %, about those for which the flux of a current is exactly zero, too. */
void test_the_current_of_the_short_circuit_cancels_the_flux_of_the_magnet_to_a_count(void)
{
    for (int32_t i_d = -17000; i_d < 0; i_d += 977) {
        const int32_t psi_d = flux_table_step(&seam.motor.flux_table, (dq_q15_t){i_d, 0}).psi_d;
        for (int32_t more = -1; more <= 1; more++) {
            setUp();
            snapshot.psi_d_error = (q15_t)(more - psi_d);
            faults = FAULT_TEMPERATURE;
            (void)step(RUN_STATE_RUN);
            TEST_ASSERT_EQUAL_INT32(tried_i_d(snapshot.psi_d_error), drive.task.switch_off.i_d);
        }
    }
}

void test_without_a_magnet_there_is_nothing_to_cancel(void)
{
    snapshot.psi_d_error = -32000;
    faults = FAULT_TEMPERATURE;
    (void)step(RUN_STATE_RUN);
    TEST_ASSERT_EQUAL_INT32(0, drive.task.switch_off.i_d);
}
