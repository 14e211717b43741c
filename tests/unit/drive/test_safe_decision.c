/* SPDX-License-Identifier: Apache-2.0 */
/* What the decision between short circuit and disabled switching gets from the drive, and which bridge it concerns. Its
 * parts are tested in tests/unit/safety. */
#include "drive/safe_decision.h"

#include "hal/mock_adc.h"
#include "hal/mock_angle.h"
#include "hal/mock_irq.h"
#include "hal/mock_pwm.h"
#include "hal/mock_temperature.h"
#include "seam.h"
#include "types/faults.h"
#include "unity.h"

#define FAST Q31(0.7) /* the line-to-line back-EMF is above 0.9 v_dc */
#define SLOW Q31(0.3)

static snapshot_t snapshot;

void setUp(void)
{
    seam_start();
    snapshot = (snapshot_t){.sample = {.v_dc = 12000, .point = {.omega = SLOW}}};
    drive.task.armed = true;
}

void tearDown(void)
{
}

static safe_t step(void)
{
    return safe_decision_step(&drive, &snapshot);
}

/* Counts a step in which the currents of the short circuit are too small for a machine that turns. */
static bool are_currents_valid(uint32_t faults, int32_t mean_of_phases)
{
    setUp();
    snapshot.shorted = true;
    snapshot.faults = faults;
    snapshot.sample.zero_q28 = mean_of_phases * 8192;
    (void)step();
    return drive.task.safe_state.without_current == 1;
}

void test_currents_of_a_sensor_that_is_known_to_be_wrong_decide_nothing(void)
{
    TEST_ASSERT_TRUE(are_currents_valid(0, 0));
    TEST_ASSERT_TRUE(are_currents_valid(FAULT_OVER_CURRENT | FAULT_CURRENT_SUM, 0));
    TEST_ASSERT_FALSE(are_currents_valid(FAULT_CURRENT_STUCK, 0));
    TEST_ASSERT_FALSE(are_currents_valid(FAULT_PHASE_LOST, 0));
    TEST_ASSERT_FALSE(are_currents_valid(FAULT_INPUT, 0));
    const int32_t largest = seam.motor.monitor.zero_sequence_max;
    TEST_ASSERT_TRUE(are_currents_valid(0, largest));
    TEST_ASSERT_TRUE(are_currents_valid(0, -largest));
    TEST_ASSERT_FALSE(are_currents_valid(0, largest + 1));
    TEST_ASSERT_FALSE(are_currents_valid(0, -largest - 1));
}

/* A current that flows against the dc link for long shows a shorted switch. While the diodes rectify, and where no
 * current beyond the sensors' error flows, nothing is summed up. */
void test_only_a_current_that_the_dc_link_opposes_shows_a_shorted_switch(void)
{
    const int32_t alive = seam.motor.gate_fault.i_alive;
    static const struct {
        int32_t i_above, mean;
        bool rectifies, sums;
    } cases[] = {{1, 0, false, true},
                 {0, 0, false, false},
                 {1, 0, true, false},
                 {200, 100, false, false},
                 {201, 100, false, true}};
    for (unsigned n = 0; n < sizeof cases / sizeof cases[0]; n++) {
        setUp();
        snapshot.i_magnitude = (q15_t)(alive + cases[n].i_above);
        snapshot.sample.zero_q28 = cases[n].mean * 8192;
        drive.task.safe_state.rectifies = cases[n].rectifies;
        (void)step();
        TEST_ASSERT_EQUAL(cases[n].sums, drive.task.gate_fault.opposed > 0);
    }
}

void test_a_shorted_switch_is_known_until_the_gate_fault_is_reset(void)
{
    drive.task.gate_fault.switch_shorted = true;
    snapshot.faults = FAULT_GATE | FAULT_OVER_CURRENT;
    TEST_ASSERT_EQUAL(SAFE_SHORT_CIRCUIT, step());
    TEST_ASSERT_TRUE(drive.task.gate_fault.switch_shorted);
    snapshot.faults = FAULT_OVER_CURRENT;
    (void)step();
    TEST_ASSERT_FALSE(drive.task.gate_fault.switch_shorted);
}

/* Before its first start a bridge has no supply for its gates. */
void test_a_bridge_that_has_not_run_is_not_shorted_by_a_fault(void)
{
    snapshot.sample.point.omega = FAST;
    snapshot.faults = FAULT_OVER_CURRENT;
    TEST_ASSERT_EQUAL(SAFE_SHORT_CIRCUIT, step());
    setUp();
    drive.task.armed = false;
    snapshot.sample.point.omega = FAST;
    snapshot.faults = FAULT_OVER_CURRENT;
    TEST_ASSERT_EQUAL(SAFE_FREEWHEEL, step());
    TEST_ASSERT_FALSE(drive.task.armed);
}

/* Without it a machine at high speed would brake into the battery as soon as its faults are reset. */
void test_a_short_circuit_stays_after_the_reset_of_the_faults_while_the_machine_is_fast(void)
{
    snapshot.sample.point.omega = FAST;
    snapshot.faults = FAULT_OVER_CURRENT;
    TEST_ASSERT_EQUAL(SAFE_SHORT_CIRCUIT, step());
    snapshot.faults = 0;
    TEST_ASSERT_EQUAL(SAFE_SHORT_CIRCUIT, step());
    TEST_ASSERT_TRUE(drive.task.armed);
    snapshot.sample.point.omega = SLOW;
    for (int n = 0; n < 120 && drive.task.safe_state.short_circuit; n++) { /* the known speed falls by 0.004 per step */
        TEST_ASSERT_TRUE(drive.task.armed);
        (void)step();
    }
    TEST_ASSERT_FALSE(drive.task.safe_state.short_circuit);
    TEST_ASSERT_FALSE(drive.task.armed); /* in the step in which it ends */
    TEST_ASSERT_EQUAL(SAFE_FREEWHEEL, step());
    snapshot.sample.point.omega = FAST;
    TEST_ASSERT_EQUAL(SAFE_FREEWHEEL, step()); /* it was disabled below the level, and stays so */
    TEST_ASSERT_FALSE(drive.task.armed);
}

/* Torque psi_d i_q - psi_q i_d: both terms brake, at 0.3 of the speed base. A gate fault would short it there, too. */
void test_a_machine_that_brakes_by_either_term_of_its_torque_is_shorted_on_over_voltage(void)
{
    drive.task.run_state = RUN_STATE_RUN;
    (void)step(); /* the gate fault is decided with the back-EMF of the step before */
    snapshot.sample.point.i.q = -30000;
    snapshot.sample.point.flux.psi_d = 12000;
    TEST_ASSERT_EQUAL(SAFE_SHORT_ON_EITHER, step());
    snapshot.sample.point.i = (dq_q15_t){-30000, 0};
    snapshot.sample.point.flux = (flux_point_t){.psi_q = -12000};
    TEST_ASSERT_EQUAL(SAFE_SHORT_ON_EITHER, step());
    snapshot.sample.point.flux.psi_q = 12000;
    TEST_ASSERT_EQUAL(SAFE_SHORT_ON_GATE_FAULT, step());
}

/* Another fault has disabled switching before: the currents that charge the link already decay. */
void test_a_latched_fault_prepares_no_short_circuit_on_over_voltage(void)
{
    drive.task.run_state = RUN_STATE_RUN;
    (void)step();
    snapshot.sample.point.i.q = -30000;
    snapshot.sample.point.flux.psi_d = 12000;
    TEST_ASSERT_EQUAL(SAFE_SHORT_ON_EITHER, step());
    snapshot.faults = FAULT_OVER_CURRENT;
    TEST_ASSERT_EQUAL(SAFE_SHORT_ON_GATE_FAULT, step());
    snapshot.faults = FAULT_OVER_VOLTAGE; /* its short circuit was decided in the period in which it occurred */
    TEST_ASSERT_EQUAL(SAFE_SHORT_ON_GATE_FAULT, step());
}

/* At 0.4 of the speed base the line-to-line back-EMF is 0.303, below 0.9 v_dc = 0.33; a tenth more flux makes 0.373. */
void test_a_stronger_magnet_is_shorted_at_lower_speed(void)
{
    snapshot.sample.point.omega = Q31(0.4);
    snapshot.faults = FAULT_OVER_CURRENT;
    TEST_ASSERT_NOT_EQUAL(SAFE_SHORT_CIRCUIT, step());
    snapshot.psi_d_error = Q15(0.1);
    TEST_ASSERT_EQUAL(SAFE_SHORT_CIRCUIT, step());
}

/* From step to step and within a period. */
void test_the_currents_of_the_short_circuit_confirm_the_speed_while_they_stand_still(void)
{
    snapshot.shorted = true;
    snapshot.sample.point.i = (dq_q15_t){-8000, 1000};
    snapshot.i_last_period = (dq_q15_t){-7900, 1100};
    (void)step();
    TEST_ASSERT_EQUAL_UINT8(0, drive.task.safe_state.steady); /* before it there was none */
    (void)step();
    TEST_ASSERT_EQUAL_UINT8(1, drive.task.safe_state.steady);
    snapshot.i_last_period = (dq_q15_t){-6000, 1000};
    (void)step();
    TEST_ASSERT_EQUAL_UINT8(0, drive.task.safe_state.steady);
}

/* The flux of the currents, without that of the magnets, is compared with an eighth of the magnets'. */
void test_a_machine_whose_short_circuit_has_no_currents_is_at_rest(void)
{
    static const struct {
        int32_t psi_d, psi_q;
        uint8_t count;
    } cases[] = {{14000, 0, 1}, {10000, 0, 0}, {14000, 4000, 0}, {14000, -4000, 0}, {0, 0, 0}};
    for (unsigned n = 0; n < sizeof cases / sizeof cases[0]; n++) {
        setUp();
        snapshot.shorted = true;
        snapshot.sample.point.flux =
            (flux_point_t){.psi_d = (q15_t)cases[n].psi_d, .psi_q = (q15_t)cases[n].psi_q, .psi_f0 = 14000};
        (void)step();
        TEST_ASSERT_EQUAL_UINT8(cases[n].count, drive.task.safe_state.without_current);
    }
}

/* A speed that rises after a fault of the angle or of the converters is not the rotor's. */
void test_the_speed_of_a_wrong_sensor_closes_no_short_circuit(void)
{
    static const uint32_t wrong[] = {FAULT_ANGLE, FAULT_INPUT, FAULT_ANGLE | FAULT_INPUT};
    for (unsigned n = 0; n < sizeof wrong / sizeof wrong[0]; n++) {
        setUp();
        snapshot.sample.point.omega = FAST;
        snapshot.faults = wrong[n];
        TEST_ASSERT_NOT_EQUAL(SAFE_SHORT_CIRCUIT, step());
    }
}

/* Below the speed level, and with a dc voltage above the one at which the over-voltage has ended. */
void test_a_short_circuit_is_kept_for_an_over_voltage_only(void)
{
    snapshot.sample.v_dc = seam.motor.safe_state.v_release + 1;
    snapshot.shorted = true;
    snapshot.faults = FAULT_OVER_VOLTAGE;
    TEST_ASSERT_EQUAL(SAFE_SHORT_CIRCUIT, step());
    setUp();
    snapshot.sample.v_dc = seam.motor.safe_state.v_release + 1;
    snapshot.shorted = true;
    snapshot.faults = FAULT_OVER_CURRENT;
    TEST_ASSERT_NOT_EQUAL(SAFE_SHORT_CIRCUIT, step());
    setUp();
    snapshot.sample.v_dc = seam.motor.safe_state.v_release + 1;
    snapshot.faults = FAULT_OVER_VOLTAGE; /* with switching disabled */
    TEST_ASSERT_NOT_EQUAL(SAFE_SHORT_CIRCUIT, step());
}

/* At rest a gate fault needs no short circuit, and no current shows a shorted switch. */
void test_a_gate_fault_at_rest_disables_switching(void)
{
    snapshot.sample.point.omega = 0;
    snapshot.faults = FAULT_GATE;
    TEST_ASSERT_EQUAL(SAFE_FREEWHEEL, step());
}
