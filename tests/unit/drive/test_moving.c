/* SPDX-License-Identifier: Apache-2.0 */
/* A movement in the drive: its frame in the fast ISR, its currents in place of the torque path, its end at once. */
#include "drive/slow_monitors.h"
#include "hal/mock_adc.h"
#include "hal/mock_angle.h"
#include "hal/mock_irq.h"
#include "hal/mock_pwm.h"
#include "hal/mock_temperature.h"
#include "seam.h"
#include "unity.h"

static movement_request_t *const wanted = &drive.request.movement;

/* The rotor stands at a quarter of a turn of the sensor. */
void setUp(void)
{
    seam_start();
    slow_monitors_without_machine(&seam.motor); /* the currents of the seam do not follow the voltage */
    seam.theta_m = 0x40000000U;
    seam_periods(20);
    *wanted = (movement_request_t){.movement = MOVEMENT_SPIN, .pole_pairs = 3, .alive = true, .may_begin = true};
}

void tearDown(void)
{
}

static const sample_t *sample(void)
{
    return sample_box_at(&drive.samples, drive.samples.generation);
}

static void run(void)
{
    seam_periods(20);
    TEST_ASSERT_TRUE(movement_is_agreed(&drive.task.movement));
    drive.request.enable = true;
    seam_periods(20);
    TEST_ASSERT_EQUAL_INT(RUN_STATE_RUN, drive.task.run_state);
}

void test_the_connection_acts_while_switching_is_enabled(void)
{
    run();
    TEST_ASSERT_EQUAL_HEX32(0xC0000000U, sample()->theta_e);
    TEST_ASSERT_TRUE(seam.gates);
    drive.request.enable = false;
    seam_periods(20);
    const uint32_t own = motor.angle_tracker.pole_pairs * 0x40000000U + motor.angle_tracker.offset;
    TEST_ASSERT_EQUAL_HEX32(own, sample()->theta_e);
    TEST_ASSERT_EQUAL_UINT32(0, drive.fast.faults);
}

void test_the_currents_of_the_movement_are_the_references(void)
{
    run();
    wanted->i = (dq_q15_t){100, -200};
    seam_periods(200);
    TEST_ASSERT_EQUAL_INT32(100, drive.task.i_ref.d);
    TEST_ASSERT_EQUAL_INT32(-200, drive.task.i_ref.q);
    TEST_ASSERT_FALSE(window_box_at(&drive.windows)->acting); /* nothing is identified */
}

void test_the_imposed_angle_turns_whatever_the_rotor_does(void)
{
    wanted->movement = MOVEMENT_IMPOSED;
    wanted->direction = MOVEMENT_FORWARD;
    run();
    const uint32_t before = sample()->theta_e;
    seam_periods(10000); /* a second at 10 kHz: 0.5 s of slope, then one turn per second */
    TEST_ASSERT_UINT32_WITHIN(0x04000000U, 0xC0000000U, sample()->theta_e - before);
    TEST_ASSERT_EQUAL_UINT32(0, drive.fast.faults);
}

/* The encoder's index has not passed: only the imposed angle does without the sensor's. */
void test_the_imposed_movement_alone_runs_without_an_absolute_angle(void)
{
    for (unsigned kind = MOVEMENT_IMPOSED; kind <= MOVEMENT_CONNECTED; kind++) {
        setUp();
        seam.angle_unknown = true;
        wanted->movement = (uint8_t)kind;
        seam_periods(20);
        TEST_ASSERT_TRUE(movement_is_agreed(&drive.task.movement));
        drive.request.enable = true;
        for (int n = 0; n < 20; n++) {
            seam_periods(10);
            TEST_ASSERT_EQUAL(kind == MOVEMENT_IMPOSED && n > 0, seam.gates);
        }
    }
}

/* When it is no longer agreed, the missing angle forbids switching again. */
void test_the_end_of_an_imposed_movement_without_an_absolute_angle_disables_switching(void)
{
    for (int late = 0; late <= 1; late++) {
        setUp();
        seam.angle_unknown = true;
        wanted->movement = MOVEMENT_IMPOSED;
        run();
        wanted->alive = late == 0;
        wanted->movement = MOVEMENT_NONE;
        for (int n = 0; n < 20; n++) {
            seam_periods(11);
            TEST_ASSERT_FALSE(seam.gates);
        }
        drive.request.enable = false;
        wanted->alive = true;
        seam_periods(20);
        TEST_ASSERT_EQUAL_INT(MOVEMENT_PHASE_IDLE, drive.task.movement.phase);
        drive.request.enable = true;
        seam_periods(20);
        TEST_ASSERT_FALSE(seam.gates);
        seam.angle_unknown = false;
        seam_periods(20);
        TEST_ASSERT_TRUE(seam.gates);
    }
}

void test_silence_disables_switching_in_the_next_step(void)
{
    run();
    wanted->alive = false;
    seam_periods(11);
    TEST_ASSERT_FALSE(seam.gates);
    TEST_ASSERT_EQUAL_INT(MOVEMENT_FAILURE_SILENT, drive.task.movement.failure);
    wanted->alive = true;
    seam_periods(100); /* enable is still on */
    TEST_ASSERT_FALSE(seam.gates);
    TEST_ASSERT_EQUAL_UINT32(0, drive.fast.faults);
}

/* An eighth of the largest torque: without a second level a larger one needs a connection that is known. */
void test_a_connection_allows_a_small_torque_request_and_currents_none(void)
{
    wanted->movement = MOVEMENT_CONNECTED;
    run();
    drive.request.torque_arbitrated = (q15_t)(-motor.torque_max / 8);
    seam_periods(20);
    TEST_ASSERT_TRUE(movement_is_agreed(&drive.task.movement));
    drive.request.torque_arbitrated--;
    seam_periods(20);
    TEST_ASSERT_EQUAL_INT(MOVEMENT_FAILURE_STOPPED, drive.task.movement.failure);
    TEST_ASSERT_FALSE(seam.gates);
    setUp();
    run();
    drive.request.torque_arbitrated = 1;
    seam_periods(20);
    TEST_ASSERT_EQUAL_INT(MOVEMENT_FAILURE_STOPPED, drive.task.movement.failure);
}

/* The magnet's flux is a guess, by which the machine would be fast enough for a short circuit. */
void test_a_movement_that_ends_at_speed_leaves_the_bridge_off(void)
{
    run();
    drive.task.safe_state.speed = Q15_MAX;
    wanted->alive = false;
    seam_periods(11);
    TEST_ASSERT_FALSE(seam.gates);
    TEST_ASSERT_FALSE(drive_is_shorted(&drive));
    TEST_ASSERT_TRUE(drive.task.safe_state.short_circuit);
}

void test_pulses_need_a_connection_without_currents(void)
{
    run();
    drive.request.pulses_agreed = true;
    drive.request.pulses.config = (pulses_config_t){
        .d = {.v = 1000, .low = -1000, .high = 1000}, .q = {.low = -1, .high = 1}, .reversals = 2, .periods_max = 5};
    drive.request.pulses.starts++;
    seam_periods(10);
    TEST_ASSERT_EQUAL_INT(PULSES_REFUSED, drive.task.pulsing.failure);
    drive.request.enable = false;
    wanted->movement = MOVEMENT_NONE;
    seam_periods(20);
    wanted->movement = MOVEMENT_CONNECTED;
    run();
    drive.request.pulses.starts++;
    seam_periods(12);
    TEST_ASSERT_EQUAL_INT(PULSES_GOOD, drive.task.pulsing.failure);
    TEST_ASSERT_EQUAL_INT(PULSES_PULSE, drive.pulses_state.phase);
    TEST_ASSERT_EQUAL_HEX32(0xC0000000U, sample()->theta_e);
}

/* Five electrical turns for each of the sensor, whatever the motor data say; one LSB for the ratio's rounding. */
void test_angle_advance_and_speed_of_the_control_are_those_of_the_connection(void)
{
    const int32_t pole_pairs = (int32_t)motor.angle_tracker.pole_pairs;
    const command_t command = {.run = BRIDGE_MOVED};
    sample_t now = {.theta_m = 0x10000000U, .point = {.omega = 100000 * pole_pairs}};
    TEST_ASSERT_NOT_EQUAL(5, pole_pairs);
    wanted->pole_pairs = 5;
    run();
    TEST_ASSERT_INT32_WITHIN(1, 5000, drive_take_frame(&drive, &command, &now, 1000 * pole_pairs));
    TEST_ASSERT_EQUAL_HEX32(0x50000000U, now.theta_e);
    TEST_ASSERT_INT32_WITHIN(1, 500000, now.point.omega);
    TEST_ASSERT_EQUAL_INT32(100000 * pole_pairs, drive.frame_angle.omega_sensor);
}

void test_a_fault_and_the_papers_identification_end_a_movement(void)
{
    for (int paper = 0; paper <= 1; paper++) {
        setUp();
        run();
        if (paper) {
            drive.request.identification_mode = IDENTIFICATION_PAPER;
        } else {
            drive_raise_fault(&drive, FAULT_OVER_CURRENT);
        }
        seam_periods(20);
        TEST_ASSERT_EQUAL_INT(MOVEMENT_FAILURE_STOPPED, drive.task.movement.failure);
        TEST_ASSERT_FALSE(seam.gates);
    }
}

void test_a_movement_ends_above_the_largest_speed_of_the_sensor(void)
{
    const snapshot_t at_speed = {.generation = 0};
    run();
    drive.frame_angle.omega_sensor = -motor.movement.omega_max;
    drive_move(&drive, &at_speed);
    TEST_ASSERT_TRUE(movement_is_agreed(&drive.task.movement));
    drive.frame_angle.omega_sensor--;
    drive_move(&drive, &at_speed);
    TEST_ASSERT_EQUAL_INT(MOVEMENT_FAILURE_FAST, drive.task.movement.failure);
}

/* A rotor that has begun to turn moves more in one interval of the damping than in the one before. */
void test_the_rotor_that_becomes_faster_weakens_a_damped_current(void)
{
    bool weak = false;
    wanted->movement = MOVEMENT_IMPOSED;
    wanted->damped = true;
    run();
    seam_periods(300);
    TEST_ASSERT_FALSE(drive.task.movement.weak);
    seam.theta_m += 0x00100000U;
    for (int n = 0; n < 12; n++) {
        seam_periods(10);
        weak = weak || drive.task.movement.weak;
    }
    TEST_ASSERT_TRUE(weak);
    TEST_ASSERT_TRUE(movement_is_agreed(&drive.task.movement));
}

void test_the_bridge_controls_currents_or_makes_pulses_with_or_without_a_movement(void)
{
    TEST_ASSERT_EQUAL_INT(BRIDGE_CONTROL, drive_bridge_mode(&drive, true));
    drive.task.pulsing.phase = PULSES_PULSE;
    TEST_ASSERT_EQUAL_INT(BRIDGE_PULSES, drive_bridge_mode(&drive, true));
    drive.task.movement.phase = MOVEMENT_PHASE_AGREED;
    TEST_ASSERT_EQUAL_INT(BRIDGE_MOVED_PULSES, drive_bridge_mode(&drive, true));
    TEST_ASSERT_EQUAL_INT(BRIDGE_OFF, drive_bridge_mode(&drive, false));
    drive.task.pulsing.phase = PULSES_DONE;
    TEST_ASSERT_EQUAL_INT(BRIDGE_MOVED, drive_bridge_mode(&drive, true));
}
