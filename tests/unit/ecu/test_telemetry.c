/* SPDX-License-Identifier: Apache-2.0 */
#include "ecu/telemetry.h"

#include "hal/mock_temperature.h"
#include "unity.h"

/* hsm1: V_b = 540 V, I_b = 400 A, T_b = 294.664 N·m, Z_b = 1.35 ohm, psi_b = 0.16370223 Vs, 3 pole pairs. */
#define Q15_OF(x, base) ((int32_t)((x) / (base)*32768.0))
#define Q31_OF(x, base) ((q31_t)((x) / (base)*2147483648.0))

static drive_t drive;
static sample_t sample;
static telemetry_t telemetry;

void setUp(void)
{
    drive_init(&drive, &motor);
    sample = (sample_t){.v_dc = Q15_OF(350.0, 540.0)};
    hal_temperature_winding_dC_IgnoreAndReturn(955);
    hal_temperature_inverter_dC_IgnoreAndReturn(-12);
}

void tearDown(void)
{
}

static const telemetry_t *read_back(void)
{
    *sample_box_begin(&drive.samples) = sample;
    sample_box_publish(&drive.samples);
    telemetry = (telemetry_t){0};
    const can_tx_t tx = {.pending = UINT16_MAX}; /* each message */
    telemetry_read(&drive, &tx, &telemetry);
    return &telemetry;
}

/* One count is 400/32768 A = 0.012 A or 0.016 V. 1.5 (-30 V * -50 A + 100 V * 120 A)/350 V = 57.857 A. */
void test_the_dc_current_follows_from_the_power_of_the_bridge(void)
{
    sample.point.i = (dq_q15_t){Q15_OF(-50.0, 400.0), Q15_OF(120.0, 400.0)};
    sample.point.u = (dq_q15_t){Q15_OF(-30.0, 540.0), Q15_OF(100.0, 540.0)};
    const telemetry_t *t = read_back();
    TEST_ASSERT_FLOAT_WITHIN(0.013F, -50.0F, t->id_A);
    TEST_ASSERT_FLOAT_WITHIN(0.013F, 120.0F, t->iq_A);
    TEST_ASSERT_FLOAT_WITHIN(0.017F, 350.0F, t->v_dc_V);
    TEST_ASSERT_FLOAT_WITHIN(0.03F, 57.857F, t->i_dc_A);
}

/* 61 counts are 1.005 V, 60 are 0.989 V. Below 1 V the quotient of power and voltage would be noise. */
void test_below_1_V_of_dc_voltage_the_reported_dc_current_is_zero(void)
{
    sample.point.i.q = Q15_OF(100.0, 400.0);
    sample.point.u.q = Q15_OF(1.0, 540.0);
    sample.v_dc = 61;
    TEST_ASSERT_FLOAT_WITHIN(2.0F, 149.0F, read_back()->i_dc_A);
    sample.v_dc = 60;
    TEST_ASSERT_EQUAL_FLOAT(0.0F, read_back()->i_dc_A);
    sample.v_dc = 0;
    TEST_ASSERT_EQUAL_FLOAT(0.0F, read_back()->i_dc_A);
}

/* 3000 rpm with 3 pole pairs are 942.478 rad/s electrical. */
void test_the_speed_is_mechanical_and_signed(void)
{
    sample.point.omega = Q31_OF(-942.478, 3298.6724);
    TEST_ASSERT_FLOAT_WITHIN(0.01F, -3000.0F, read_back()->speed_rpm);
}

void test_the_reported_current_reference_is_the_one_that_acts(void)
{
    drive.request.i_ref = (dq_q15_t){Q15_OF(-10.0, 400.0), Q15_OF(20.0, 400.0)};
    drive.task.reference.i_ref = (dq_q15_t){Q15_OF(-30.0, 400.0), Q15_OF(40.0, 400.0)};
    const telemetry_t *t = read_back();
    TEST_ASSERT_FLOAT_WITHIN(0.013F, -30.0F, t->id_ref_A);
    TEST_ASSERT_FLOAT_WITHIN(0.013F, 40.0F, t->iq_ref_A);
    drive.request.current_mode = true;
    t = read_back();
    TEST_ASSERT_FLOAT_WITHIN(0.013F, -10.0F, t->id_ref_A);
    TEST_ASSERT_FLOAT_WITHIN(0.013F, 20.0F, t->iq_ref_A);
}

void test_the_torques_are_reported_in_newton_metres(void)
{
    drive.task.identification.torque_estimated = (q15_t)Q15_OF(55.0, 294.664);
    drive.task.torque_commanded = (q15_t)Q15_OF(-60.0, 294.664);
    drive.task.reference.torque_max = (q15_t)Q15_OF(120.0, 294.664);
    const telemetry_t *t = read_back();
    TEST_ASSERT_FLOAT_WITHIN(0.01F, 55.0F, t->torque_estimated_Nm);
    TEST_ASSERT_FLOAT_WITHIN(0.01F, -60.0F, t->torque_commanded_Nm);
    TEST_ASSERT_FLOAT_WITHIN(0.01F, 120.0F, t->torque_max_Nm);
}

/* The magnet 5 % weaker than 71.658 mVs, R 4 mohm above 18 mohm, the q-axis table 3 % too small. */
void test_the_identified_parameters_are_the_motors_plus_what_was_found(void)
{
    drive.task.identification = (identification_t){.psi_delta = Q31_OF(-0.0035829, 0.16370223),
                                                   .r_delta = Q31_OF(0.004, 1.35),
                                                   .lq_error = Q31_OF(0.03, 1.0),
                                                   .psi_quality = Q15(0.5),
                                                   .r_quality = Q15(0.25),
                                                   .r_clamped = true};
    const telemetry_t *t = read_back();
    TEST_ASSERT_FLOAT_WITHIN(0.001F, 68.0751F, t->psi_f_mVs);
    TEST_ASSERT_FLOAT_WITHIN(0.001F, 22.0F, t->r_mohm);
    TEST_ASSERT_FLOAT_WITHIN(0.001F, 103.0F, t->table_scale_percent);
    TEST_ASSERT_FLOAT_WITHIN(0.01F, 50.0F, t->psi_quality_percent);
    TEST_ASSERT_FLOAT_WITHIN(0.01F, 25.0F, t->r_quality_percent);
    TEST_ASSERT_FALSE(t->psi_clamped);
    TEST_ASSERT_TRUE(t->r_clamped);
    drive.task.identification = (identification_t){.psi_clamped = true};
    t = read_back();
    TEST_ASSERT_TRUE(t->psi_clamped);
    TEST_ASSERT_FALSE(t->r_clamped);
}

void test_a_temperature_without_a_sensor_is_reported_as_invalid(void)
{
    const telemetry_t *t = read_back();
    TEST_ASSERT_TRUE(t->winding_valid && t->inverter_valid);
    TEST_ASSERT_EQUAL_FLOAT(95.5F, t->winding_C);
    TEST_ASSERT_EQUAL_FLOAT(-1.2F, t->inverter_C);
    hal_temperature_winding_dC_IgnoreAndReturn(TEMPERATURE_UNKNOWN);
    t = read_back();
    TEST_ASSERT_TRUE(!t->winding_valid && t->inverter_valid);
    TEST_ASSERT_EQUAL_FLOAT(0.0F, t->winding_C);
    TEST_ASSERT_EQUAL_FLOAT(-1.2F, t->inverter_C);
    hal_temperature_winding_dC_IgnoreAndReturn(955);
    hal_temperature_inverter_dC_IgnoreAndReturn(TEMPERATURE_UNKNOWN);
    t = read_back();
    TEST_ASSERT_TRUE(t->winding_valid && !t->inverter_valid);
    TEST_ASSERT_EQUAL_FLOAT(95.5F, t->winding_C);
    TEST_ASSERT_EQUAL_FLOAT(0.0F, t->inverter_C);
}

void test_faults_overruns_and_the_name_of_the_motor_are_reported(void)
{
    drive.fast.faults = 0x1004;
    drive.fast.motor_check = MOTOR_CHECK_TORQUE_MAX;
    drive.mrai.mailbox.overruns = 9;
    const telemetry_t *t = read_back();
    TEST_ASSERT_EQUAL_HEX32(0x1004, t->drive_faults);
    TEST_ASSERT_EQUAL_UINT32(MOTOR_CHECK_TORQUE_MAX, t->motor_check);
    TEST_ASSERT_EQUAL_UINT32(9, t->diagnostics.isr_overruns);
    TEST_ASSERT_EQUAL_STRING("hsm1", t->motor_name);
}

/* The values that no pending message contains stay as they were. */
void test_physical_values_are_read_only_for_their_messages(void)
{
    const can_tx_t none = {0};
    telemetry = (telemetry_t){.psi_f_mVs = -1.0F,
                              .winding_C = -1.0F,
                              .speed_rpm = -1.0F,
                              .torque_max_Nm = -1.0F,
                              .v_dc_V = -1.0F,
                              .torque_estimated_Nm = -1.0F};
    telemetry_read(&drive, &none, &telemetry);
    TEST_ASSERT_EQUAL_FLOAT(-1.0F, telemetry.psi_f_mVs);
    TEST_ASSERT_EQUAL_FLOAT(-1.0F, telemetry.winding_C);
    TEST_ASSERT_EQUAL_FLOAT(-1.0F, telemetry.speed_rpm);
    TEST_ASSERT_EQUAL_FLOAT(-1.0F, telemetry.torque_max_Nm);
    TEST_ASSERT_EQUAL_FLOAT(-1.0F, telemetry.v_dc_V);
    TEST_ASSERT_EQUAL_FLOAT(-1.0F, telemetry.torque_estimated_Nm);
}
