/* SPDX-License-Identifier: Apache-2.0 */
/* Valid motor data with one wrong value at a time: the check that reports it has the name of that value. */
#include <math.h>
#include <string.h>

#include "control/current/transform.h"
#include "drive/drive.h"
#include "unity.h"

static int16_t table[4096]; /* a copy of a table of the motor with a wrong value */

void setUp(void)
{
}

void tearDown(void)
{
}

/* A check with a wrong size would miss the last value of the table, so that one is damaged. */
static const int16_t *damaged(const int16_t *good, size_t n, int16_t last)
{
    TEST_ASSERT_LESS_OR_EQUAL(sizeof table / sizeof *table, n);
    memcpy(table, good, n * sizeof *table);
    table[n - 1U] = last;
    return table;
}

static const int16_t *flux(const int16_t *good, int16_t last)
{
    const fx_mesh_t *mesh = &motor.flux_table.mesh;
    return damaged(good, (size_t)((mesh->x_last >> 14) + 2U) * mesh->ny, last);
}

static const int16_t *reference(const int16_t *good, int16_t last)
{
    const fx_grid_t *grid = &motor.current_reference.grid;
    return damaged(good, (size_t)grid->nx * grid->ny, last);
}

/* Every comparison of every check, beyond both bounds where there are two. */
#define TABLES(X) \
    X(TASK_STEP, m.bases.periods_per_step = 3) \
    X(TASK_STEP, m.bases.periods_per_step = 41) \
    X(TASK_STEP, m.bases.step_s = 0.8e-3F) \
    X(TASK_STEP, m.bases.step_s = 1.25e-3F) \
    X(FLUX_TABLE_MISSING, m.flux_table.l_d = 0) \
    X(FLUX_TABLE_MISSING, m.flux_table.l_q = 0) \
    X(FLUX_TABLE_MISSING, m.flux_table.l_qq = 0) \
    X(FLUX_TABLE_MISSING, m.flux_table.g = 0) \
    X(FLUX_TABLE_MISSING, m.flux_table.psi_f0 = 0) \
    X(FLUX_TABLE_GRID, m.flux_table.mesh.ny--) \
    X(FLUX_TABLE_GRID, m.flux_table.mesh.up = 15) \
    X(FLUX_TABLE_GRID, m.flux_table.l_shift++) \
    X(FLUX_TABLE_GRID, m.flux_table.i_scale = 8 << (m.flux_table.l_shift = 14)) \
    X(FLUX_TABLE_VALUE, m.flux_table.l_q = flux(motor.flux_table.l_q, 0)) \
    X(FLUX_TABLE_VALUE, m.flux_table.l_qq = flux(motor.flux_table.l_qq, 0)) \
    X(FLUX_TABLE_VALUE, m.flux_table.g = flux(motor.flux_table.g, -1)) \
    X(REFERENCE_TABLE_MISSING, m.current_reference.i_d = 0) \
    X(REFERENCE_TABLE_MISSING, m.current_reference.i_q = 0) \
    X(REFERENCE_TABLE_MISSING, m.current_reference.torque_max = 0) \
    X(REFERENCE_TABLE_GRID, m.current_reference.grid.nx = 1) \
    X(REFERENCE_TABLE_GRID, m.current_reference.grid.ny = 1) \
    X(REFERENCE_TABLE_VALUE, m.current_reference.i_d = reference(motor.current_reference.i_d, 1)) \
    X(REFERENCE_TABLE_VALUE, m.current_reference.i_q = reference(motor.current_reference.i_q, -1)) \
    X(CURRENT_MAX, m.current_reference.i_max = 0)

#define LIMITS(X) \
    X(TORQUE_MAX, m.torque_max = 0) \
    X(TORQUE_LIMIT, m.torque_limit.torque_max = 0) \
    X(TORQUE_LIMIT, m.torque_limit.drop = -1) \
    X(TORQUE_LIMIT, m.torque_limit.loss_rate = 0) \
    X(DERATING_STANDSTILL, m.torque_limit.moving.gain = 0) \
    X(DERATING_INVERTER, m.torque_limit.inverter.gain = 0) \
    X(DERATING_WINDING, m.torque_limit.winding.gain = 0) \
    X(DERATING_DC_LOW, m.torque_limit.dc_low.gain = 0) \
    X(DERATING_DC_HIGH, m.torque_limit.dc_high.gain = 0) \
    X(DERATING_SPEED, m.torque_limit.speed.gain = 0) \
    X(OVER_CURRENT_LEVEL, m.monitor.i_trip = 0) \
    X(OVER_CURRENT_LEVEL, m.monitor.i_trip = Q15(0.8)) \
    X(DC_VOLTAGE_LEVELS, m.monitor.v_min = m.monitor.v_max) \
    X(UNDER_VOLTAGE_LEVEL, m.monitor.v_min = (int32_t)(m.parameters.current_control.per_ratio_q31 >> 22)) \
    X(CURRENT_SUM_LEVEL, m.monitor.zero_sequence_max = 0) \
    X(CURRENT_SUM_LEVEL, m.monitor.sum_max = 3 * m.monitor.zero_sequence_max - 1) \
    X(CURRENT_SUM_LEVEL, m.monitor.sum_max = 3 * Q15_MAX + 1) \
    X(CURRENT_SUM_LEVEL, m.monitor.zero_sequence_max = INT32_MAX; m.monitor.sum_max = INT32_MAX) \
    X(NORMAL_CURRENT_LEVEL, m.monitor.i_normal_squared_q30 = m.monitor.i_trip * m.monitor.i_trip) \
    X(NORMAL_CURRENT_LEVEL, m.monitor.i_normal_squared_q30 = -1) \
    X(NORMAL_CURRENT_LEVEL, m.monitor.i_trip = m.monitor.zero_sequence_max + 11; m.monitor.i_normal_squared_q30 = 101) \
    X(NORMAL_CURRENT_LEVEL, m.monitor.i_trip = m.monitor.zero_sequence_max; m.monitor.i_normal_squared_q30 = 1) \
    X(NORMAL_CURRENT_LEVEL, m.monitor.i_trip = 1) \
    X(NORMAL_CURRENT_LEVEL, m.monitor.zero_sequence_max = m.monitor.i_trip; m.monitor.sum_max = 3 * m.monitor.i_trip) \
    X(SAFE_STATE_FLUX, m.safe_state.psi_f = 0) \
    X(SAFE_STATE_LEVELS, m.safe_state.share_open = m.safe_state.share_short) \
    X(SAFE_STATE_LEVELS, m.safe_state.share_open = 0)

#define CONTROL(X) \
    X(CURRENT_CONTROL_GAINS, m.parameters.current_control.sigma_q24 = 0) \
    X(CURRENT_CONTROL_GAINS, m.parameters.current_control.setpoint_weight = 0) \
    X(CURRENT_CONTROL_GAINS, m.parameters.current_control.integral_gain = -1) \
    X(CURRENT_CONTROL_GAINS, m.parameters.current_control.integral_gain = Q15(0.5)) \
    X(CURRENT_CONTROL_GAINS, m.parameters.current_control.tracking_gain_q34 = -1) \
    X(CURRENT_CONTROL_GAINS, m.angle_tracker.turn_shift = 1) \
    X(CURRENT_CONTROL_GAINS, m.turning_control = turning; m.turning_control.per_period_q29 = -1; limit_only(&m)) \
    X(CURRENT_CONTROL_GAINS, m.turning_control = turning; m.turning_control.approach_q32 = 0; limit_only(&m)) \
    X(CURRENT_CONTROL_GAINS, m.turning_control = turning; m.turning_control.feedback_q32 = 0; limit_only(&m)) \
    X(CURRENT_CONTROL_GAINS, m.turning_control = turning; m.turning_control.integral_q32 = 0; limit_only(&m)) \
    X(CURRENT_CONTROL_GAINS, m.turning_control = turning; m.turning_control.drop_q29 = -1; limit_only(&m)) \
    X(CURRENT_CONTROL_GAINS, m.turning_control = turning; m.turning_control.knee_turns_q27 = 0; limit_only(&m)) \
    X(CURRENT_CONTROL_GAINS, m.turning_control = turning; limit_only(&m); m.angle_tracker.turn_shift = 2) \
    X(CURRENT_CONTROL_GAINS, m.turning_control = turning; m.parameters.current_control.sigma_q24 = 0) \
    X(CURRENT_CONTROL_GAINS, m.turning_control = turning; m.parameters.current_control.integral_gain = 0) \
    X(VOLTAGE_RATIO, m.parameters.modulate.alpha_q31 = m.parameters.modulate.alpha_q31 / 1000 * 1001) \
    X(VOLTAGE_RATIO, set_side(&m, 16)) \
    X(VOLTAGE_RATIO, set_side(&m, -16)) \
    X(VOLTAGE_RATIO, set_ratio(&m, 17408, 123392)) /* the product is 1 + 2^-12 */ \
    X(VOLTAGE_RATIO, m.parameters.modulate.alpha_q31 = Q31(0.5); set_side(&m, 0); \
      m.parameters.current_control.per_ratio_q31 = UINT32_MAX) \
    X(VOLTAGE_RATIO, scale_ratio(&m, 0.7); m.parameters.modulate.alpha_q31 = Q31(0.7)) \
    X(VOLTAGE_RATIO, m.parameters.current_control.per_ratio_q31 = 0) \
    X(VOLTAGE_RATIO, scale_ratio(&m, 0.499)) \
    X(VOLTAGE_RATIO, scale_ratio(&m, 0.701)) \
    X(CURRENT_CONTROL_GAINS, m.parameters.current_control.sigma_q24 = 255) \
    X(VOLTAGE_RESERVE, m.voltage_reserve.v_ratio = 0) \
    X(VOLTAGE_RESERVE, m.voltage_reserve.trim_min = 1) \
    X(VOLTAGE_RESERVE, m.voltage_reserve.trim_max = -1) \
    X(TORQUE_LOOP, m.parameters.torque_loop.authority = 0) \
    X(TORQUE_LOOP, m.parameters.torque_loop.torque_min = 0) \
    X(SHORTEST_PULSE, m.parameters.modulate.longest_q31 = Q31(0.25)) \
    X(SHORTEST_PULSE, m.parameters.modulate.longest_q31 = m.parameters.modulate.nearer_rail_q31 + 1) \
    X(SHORTEST_PULSE, m.parameters.modulate.nearer_rail_q31 = Q31(0.5) + 1) \
    X(DEAD_TIME, m.parameters.modulate.dead_time_q16 = Q16(0.2)) \
    X(DEAD_TIME, m.parameters.modulate.dead_time_q16 = -2) \
    X(CURRENT_KNEE, m.parameters.modulate.knee_q17 = 0) \
    X(CURRENT_KNEE, m.parameters.modulate.knee_q17 = 1 << 30) \
    X(CURRENT_KNEE, m.parameters.modulate.knee_side_q17 = 0) \
    X(CURRENT_KNEE, m.parameters.modulate.knee_side_q17 = 1 << 30) \
    X(CLEAR_VOLTAGE, m.parameters.current_control.clear_q30 = largest_clear(&m) + 1U) \
    X(CLEAR_VOLTAGE, m.parameters.current_control.clear_q30 = UINT32_MAX) \
    X(CLEAR_VOLTAGE, m.parameters.current_control.clear_q30 = m.parameters.current_control.clear_q30 / 8 * 9)

/* The end of each range, which must be accepted. */
#define ENDS(X) \
    X(m.bases.periods_per_step = 4) \
    X(m.bases.periods_per_step = 40) \
    X(m.bases.step_s = 0.801e-3F) \
    X(m.bases.step_s = 1.249e-3F) \
    X(set_side(&m, 15)) \
    X(set_side(&m, -15)) \
    X(set_ratio(&m, 21840, 98304)) /* the product is 1 - 2^-12 */ \
    X(scale_ratio(&m, 0.501)) \
    X(scale_ratio(&m, 0.699)) \
    X(m.monitor.i_trip = Q15(0.8) - 1) \
    X(m.monitor.v_min = m.monitor.v_max - 1) \
    X(m.monitor.v_min = (int32_t)(m.parameters.current_control.per_ratio_q31 >> 22) + 1) \
    X(m.monitor.sum_max = 3 * m.monitor.zero_sequence_max) \
    X(m.monitor.sum_max = 3 * Q15_MAX) \
    X(m.monitor.zero_sequence_max = 1) \
    X(m.monitor.i_normal_squared_q30 = 0) \
    X(m.monitor.i_trip = m.monitor.zero_sequence_max + 1; m.monitor.i_normal_squared_q30 = 0) \
    X(m.monitor.i_trip = m.monitor.zero_sequence_max + 11; m.monitor.i_normal_squared_q30 = 100) \
    X(m.safe_state.psi_f = 1) \
    X(m.safe_state.share_open = m.safe_state.share_short - 1) \
    X(m.parameters.current_control.setpoint_weight = 1) \
    X(m.parameters.current_control.integral_gain = 0) \
    X(m.parameters.current_control.integral_gain = Q15(0.5) - 1) \
    X(m.parameters.current_control.tracking_gain_q34 = 0) \
    X(m.parameters.current_control.sigma_q24 = 256) \
    X(m.turning_control = smallest_turning; limit_only(&m); m.angle_tracker.turn_shift = 0) \
    X(m.voltage_reserve.v_ratio = 1) \
    X(m.voltage_reserve.trim_min = 0) \
    X(m.voltage_reserve.trim_max = 0) \
    X(m.parameters.torque_loop.authority = 1) \
    X(m.parameters.torque_loop.torque_min = 1) \
    X(m.torque_max = 1) \
    X(m.parameters.modulate.longest_q31 = Q31(0.25) + 1) \
    X(m.parameters.modulate.longest_q31 = m.parameters.modulate.nearer_rail_q31) \
    X(m.parameters.modulate.nearer_rail_q31 = Q31(0.5)) \
    X(m.parameters.modulate.dead_time_q16 = 0) \
    X(m.parameters.modulate.dead_time_q16 = Q16(0.2) - 1) \
    X(m.parameters.modulate.knee_q17 = 1) \
    X(m.parameters.modulate.knee_q17 = (1 << 30) - 1) \
    X(m.parameters.modulate.knee_side_q17 = 1) \
    X(m.parameters.modulate.knee_side_q17 = (1 << 30) - 1) \
    X(m.parameters.current_control.clear_q30 = largest_clear(&m))

#define MRAI(X) \
    X(MRAI_GAINS, law.r0 = 0) \
    X(MRAI_GAINS, law.pole_gain = 0) \
    X(MRAI_GAINS, law.g_shift = -16) \
    X(MRAI_GAINS, law.g_shift = 16) \
    X(MRAI_GAINS, law.period = 0) \
    X(MRAI_GAINS, law.period = Q31(0.79)) \
    X(MRAI_GAINS, law.flux_gain = -1) \
    X(MRAI_GAINS, law.resistance_gain = -1) \
    X(MRAI_GAINS, law.flux_proportional_q24 = -1) \
    X(MRAI_GAINS, law.resistance_proportional_q24 = -1) \
    X(MRAI_LIMITS, law.psi_delta_min = law.psi_delta_max) \
    X(MRAI_LIMITS, law.psi_delta_min = Q31(-0.5) - 1) \
    X(MRAI_LIMITS, law.r_delta_max = Q31(0.5) + 1) \
    X(MRAI_GATES, law.omega_min = 0) \
    X(MRAI_GATES, law.psi_drift_full = 0) \
    X(MRAI_GATES, law.r_drift_full = 0)

#define IDENTIFY(X) \
    X(IDENTIFY_WINDOW, m.identify.l_shift = 15) \
    X(IDENTIFY_WINDOW, m.identify.mean_gain_q32 = 0) \
    X(IDENTIFY_WINDOW, m.identify.rate_gain_q28 = 0) \
    X(IDENTIFY_WINDOW, m.identify.window_turns_q29 = 0) \
    X(IDENTIFY_WINDOW, m.identify.turn_to_pu = 0) \
    X(IDENTIFY_RESISTANCE, m.identify.r0 = 0) \
    X(IDENTIFY_RESISTANCE, m.identify.r_known_q30 = 0) \
    X(IDENTIFY_RESISTANCE, m.identify.r_known_q30 = (1 << 30) + 1) \
    X(IDENTIFY_NOISE, m.identify.noise_voltage_q30 = (1 << 19) - 1) \
    X(IDENTIFY_NOISE, m.identify.noise_flux_q30 = -1) \
    X(IDENTIFY_NOISE, m.identify.noise_rate_q30 = -1) \
    X(IDENTIFY_NOISE, m.identify.limited_noise = 0) \
    X(IDENTIFY_THRESHOLDS, m.identify.omega_min = 0) \
    X(IDENTIFY_THRESHOLDS, m.identify.i_min = 0) \
    X(IDENTIFY_THRESHOLDS, m.identify.i_smooth = 0) \
    X(IDENTIFY_THRESHOLDS, m.identify.i_smooth = (q15_t)(m.identify.i_min + 1)) \
    X(IDENTIFY_THRESHOLDS, m.identify.local_corner = 0) \
    X(IDENTIFY_THRESHOLDS, m.identify.local_rate = 0) \
    X(IDENTIFY_THRESHOLDS, m.identify.torque_min = 0) \
    X(IDENTIFY_CONFIDENCE, m.identify.confidence_rate = 0) \
    X(IDENTIFY_CONFIDENCE, m.identify.mismatch_rate = 0) \
    X(IDENTIFY_CONFIDENCE, m.identify.confidence_full = 0) \
    X(IDENTIFY_CONFIDENCE, m.identify.confidence_none = m.identify.confidence_full) \
    X(IDENTIFY_PRIOR, m.identify.sigma[IDENTIFY_IRON] = 0) \
    X(IDENTIFY_PRIOR, m.identify.leak[IDENTIFY_IRON] = 0) \
    X(IDENTIFY_PRIOR, m.identify.leak[IDENTIFY_R] = Q31(0.25) + 1)

static const turning_control_config_t turning = {.per_period_q29 = Q31(0.16),
                                                 .approach_q32 = Q31(0.72),
                                                 .feedback_q32 = Q31(0.56),
                                                 .integral_q32 = Q31(0.09),
                                                 .drop_q29 = Q31(0.01),
                                                 .knee_turns_q27 = 1};

/* The usual law as the limit of the other one's voltage. */
static void limit_only(motor_t *m)
{
    m->parameters.current_control.sigma_q24 = 0;
    m->parameters.current_control.integral_gain = 0;
}

void test_both_laws_of_current_control_are_accepted_with_the_gains_that_they_need(void)
{
    motor_t m = motor;
    TEST_ASSERT_EQUAL(MOTOR_CHECK_OK, motor_check(&m));
    m.turning_control = turning;
    limit_only(&m);
    m.angle_tracker.turn_shift = 1;
    TEST_ASSERT_EQUAL(MOTOR_CHECK_OK, motor_check(&m));
}

static const turning_control_config_t smallest_turning = {
    .per_period_q29 = 1, .approach_q32 = 1, .feedback_q32 = 1, .integral_q32 = 1, .drop_q29 = 0, .knee_turns_q27 = 1};

/* sqrt(3)/2 of the ratio and so many LSB. */
static void set_side(motor_t *m, int32_t more)
{
    m->parameters.modulate.side_q31 = fx_mul_q31(m->parameters.modulate.alpha_q31, Q31(SQRT3_HALF)) + more;
}

/* Ratio and inverse by those bits of both whose product is compared with 1: Q15 and Q16. */
static void set_ratio(motor_t *m, int32_t ratio_q15, uint32_t per_ratio_q16)
{
    m->parameters.modulate.alpha_q31 = ratio_q15 * 65536;
    m->parameters.current_control.per_ratio_q31 = per_ratio_q16 << 15;
    set_side(m, 0);
}

static uint32_t largest_clear(const motor_t *m)
{
    return motor_clear_q30(&m->parameters, m->parameters.modulate.dead_time_q16 / 2);
}

/* All three copies of the ratio agree. */
static void scale_ratio(motor_t *m, double ratio)
{
    m->parameters.modulate.alpha_q31 = (q31_t)(ratio * 2147483648.0);
    m->parameters.modulate.side_q31 = (q31_t)(ratio * 2147483648.0 * 0.86602540378443865);
    m->parameters.current_control.per_ratio_q31 =
        (uint32_t)(2147483648.0 / ratio > 4294967295.0 ? 4294967295.0 : 2147483648.0 / ratio);
}

typedef struct {
    motor_check_t value;
    const char *name, *words;
    bool seen;
} named_t;

#define NAMED(name, value, text) {value, #name, text, false},
static named_t checks[] = {MOTOR_CHECK_LIST(NAMED)};
#define CHECKS (sizeof checks / sizeof *checks)

/* The check with this value, which the list must have. */
static named_t *named(motor_check_t value)
{
    for (size_t n = 0; n < CHECKS; n++) {
        if (checks[n].value == value) {
            return &checks[n];
        }
    }
    TEST_FAIL_MESSAGE("the list does not name this check");
    return checks;
}

#define BREAK(expected, ...) \
    do { \
        motor_t m = motor; \
        mrai_config_t law = *motor.mrai; \
        m.mrai = &law; \
        __VA_ARGS__; \
        TEST_ASSERT_EQUAL_STRING_MESSAGE(#expected, named(motor_check(&m))->name, #__VA_ARGS__); \
        named(MOTOR_CHECK_##expected)->seen = true; \
    } while (0);

static void break_tables(void)
{
    TABLES(BREAK)
}

static void break_limits(void)
{
    LIMITS(BREAK)
}

static void break_control(void)
{
    CONTROL(BREAK)
}

static void break_identification(void)
{
    MRAI(BREAK)
    IDENTIFY(BREAK)
}

void test_one_wrong_value_is_reported_by_its_check_and_every_check_can_be_reported(void)
{
    TEST_ASSERT_EQUAL_INT(MOTOR_CHECK_OK, motor_check(&motor));
    break_tables();
    break_limits();
    break_control();
    break_identification();
    named(MOTOR_CHECK_OK)->seen = true;
    named(MOTOR_CHECK_IMAGE_CHECKSUM)->seen = true; /* reported by the port, as the next one */
    named(MOTOR_CHECK_PWM_TIMER)->seen = true;
    named(MOTOR_CHECK_LIVE_DATA)->seen = true; /* while it runs: test_data_check.c */
    for (size_t n = 0; n < CHECKS; n++) {
        TEST_ASSERT_TRUE_MESSAGE(checks[n].seen, checks[n].name);
    }
}

/* The bound of (MO-11) is 0, so that it does not forbid what the checks before it accept. */
#define ACCEPT(...) \
    do { \
        motor_t m = motor; \
        m.parameters.current_control.clear_q30 = 0; \
        __VA_ARGS__; \
        TEST_ASSERT_EQUAL_STRING_MESSAGE("OK", named(motor_check(&m))->name, #__VA_ARGS__); \
    } while (0);

void test_the_ends_of_all_ranges_are_accepted(void)
{
    ENDS(ACCEPT)
}

/* (MO-11): 2 (longest - dead time)/sqrt(3) over the ratio, squared; at most (31/32)^2. The ratio's inverse has 16 bits,
 * of which the square loses up to 2^-15, and dead time and product two more: 1e-4. */
void test_the_voltage_that_cannot_be_limited_follows_from_the_longest_pulse_and_the_dead_time(void)
{
    motor_t m = motor;
    const double ratio = m.parameters.modulate.alpha_q31 / 2147483648.0;
    for (int32_t dead_time = 0; dead_time < 16000; dead_time += 500) {
        const double longest = (m.parameters.modulate.longest_q31 >> 16) - dead_time;
        const double per_unit = (longest > 0.0) ? 2.0 * longest / 32768.0 / sqrt(3.0) / ratio : 0.0;
        TEST_ASSERT_DOUBLE_WITHIN(1e-4, per_unit * per_unit, motor_clear_q30(&m.parameters, dead_time) / 1073741824.0);
    }
    TEST_ASSERT_EQUAL_UINT32(0, motor_clear_q30(&m.parameters, 30000));
    set_ratio(&m, 16385, 131060);
    m.parameters.modulate.longest_q31 = Q31(0.5);
    TEST_ASSERT_EQUAL_UINT32(31U * 31U << 20, motor_clear_q30(&m.parameters, 0));
}

void test_the_first_reason_is_kept_and_a_passed_check_is_no_fault(void)
{
    static drive_t drive;
    drive_init(&drive, &motor);
    drive_refuse(&drive, MOTOR_CHECK_OK);
    TEST_ASSERT_EQUAL_HEX32(0, drive.fast.faults);
    TEST_ASSERT_EQUAL_INT(MOTOR_CHECK_OK, drive_motor_check(&drive));
    drive_refuse(&drive, MOTOR_CHECK_PWM_TIMER);
    drive_refuse(&drive, MOTOR_CHECK_IMAGE_CHECKSUM);
    TEST_ASSERT_EQUAL_HEX32(FAULT_CONFIG, drive.fast.faults);
    TEST_ASSERT_EQUAL_INT(MOTOR_CHECK_PWM_TIMER, drive_motor_check(&drive));
}

void test_every_check_has_a_value_a_name_and_words_of_its_own(void)
{
    for (size_t a = 0; a < CHECKS; a++) {
        TEST_ASSERT_LESS_OR_EQUAL(UINT8_MAX, checks[a].value); /* the drive keeps a byte */
        for (size_t b = 0; b < a; b++) {
            TEST_ASSERT_NOT_EQUAL_INT(checks[b].value, checks[a].value);
            TEST_ASSERT_TRUE_MESSAGE(strcmp(checks[a].name, checks[b].name) != 0, checks[a].name);
            TEST_ASSERT_TRUE_MESSAGE(strcmp(checks[a].words, checks[b].words) != 0, checks[a].name);
        }
    }
    TEST_ASSERT_EQUAL_INT(0, MOTOR_CHECK_OK);
}
