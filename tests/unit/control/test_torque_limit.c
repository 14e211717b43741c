/* SPDX-License-Identifier: Apache-2.0 */
#include "control/torque/limit.h"

#include <math.h>

#include "fixture.h"
#include "fx/vec.h"
#include "unity.h"

static fixture_t f;
static torque_limit_state_t state;
static torque_limits_t limits;
static torque_limit_in_t in;

enum { RATED = 19661, AMBIENT_C = 200 };

static q15_t counts(double x)
{
    return (q15_t)lround(x * 32768.0);
}

/* Half speed, 350 V, 20 C, no limit active; 0.25 of torque is arbitrated, and no loss is measured. */
void setUp(void)
{
    f = fixture();
    state = (torque_limit_state_t){0};
    limits = TORQUE_LIMITS_NONE;
    in = (torque_limit_in_t){.torque_arbitrated = counts(0.25),
                             .limits = &limits,
                             .omega = counts(0.5),
                             .v_dc = 21845,
                             .reach = INT16_MAX,
                             .inverter_dC = AMBIENT_C,
                             .winding_dC = AMBIENT_C};
}

void tearDown(void)
{
}

static torque_limit_t step(void)
{
    in.current = fx_magnitude(in.i.d, in.i.q);
    return torque_limit_step(&f.torque_limit, &state, &in);
}

void test_without_an_active_limit_the_arbitrated_torque_is_not_changed(void)
{
    for (int sign = -1; sign <= 1; sign++) {
        in.torque_arbitrated = (q15_t)(sign * 8000);
        const torque_limit_t y = step();
        TEST_ASSERT_EQUAL_INT(sign * 8000, y.torque_limited);
        TEST_ASSERT_EQUAL_HEX16(0, y.derating);
        TEST_ASSERT_EQUAL_INT(RATED, y.drive);
        TEST_ASSERT_EQUAL_INT(RATED, y.regen);
    }
}

/* Also a torque sent in a wrong unit is limited to the rated one. */
void test_the_limited_torque_does_not_exceed_the_rated_one(void)
{
    in.torque_arbitrated = INT16_MAX;
    TEST_ASSERT_EQUAL_INT(RATED, step().torque_limited);
    in.torque_arbitrated = INT16_MIN;
    TEST_ASSERT_EQUAL_INT(-RATED, step().torque_limited);
    TEST_ASSERT_EQUAL_HEX16(DERATING_REQUEST, step().derating);
}

/* Measured losses are kept between 0 and a quarter of the base. */
void test_the_measured_loss_stays_within_its_range(void)
{
    in.u = in.i = (dq_q15_t){32767, 0};
    for (int n = 0; n < 100000; n++) {
        (void)step();
    }
    TEST_ASSERT_EQUAL_INT32(1 << 29, state.loss);
    in.u.d = -32767;
    for (int n = 0; n < 100000; n++) {
        (void)step();
    }
    TEST_ASSERT_EQUAL_INT32(0, state.loss);
}

/* With losses of 0.25 a limit of 1 would leave 0.77 of the torque at this speed. */
void test_without_a_power_limit_the_losses_do_not_limit(void)
{
    torque_limit_config_t c = f.torque_limit;
    c.torque_max = INT16_MAX;
    c.speed = (derating_line_t){.end = INT16_MAX, .gain = -(1 << 30)};
    state.loss = 1 << 29;
    in.omega = in.torque_arbitrated = 32000;
    const torque_limit_t y = torque_limit_step(&c, &state, &in);
    TEST_ASSERT_EQUAL_INT(32000, y.torque_limited);
    TEST_ASSERT_EQUAL_HEX16(0, y.derating);
}

/* Any power permits any torque where nothing turns, and no power permits none. */
void test_at_standstill_the_least_power_does_not_limit_and_none_allows_no_torque(void)
{
    in.omega = 0;
    limits.power_drive = 1;
    TEST_ASSERT_EQUAL_INT(RATED, step().drive);
    limits.power_drive = 0;
    TEST_ASSERT_EQUAL_INT(0, step().drive);
}

/* There both signs are driving torque, and so are the reasons. */
void test_at_standstill_the_reason_is_that_of_the_driving_limit_for_both_signs(void)
{
    in.omega = 0;
    limits.torque_drive = 5000;
    for (int sign = -1; sign <= 1; sign += 2) {
        in.torque_arbitrated = (q15_t)(sign * 8000);
        const torque_limit_t y = step();
        TEST_ASSERT_EQUAL_INT(sign * 5000, y.torque_limited);
        TEST_ASSERT_EQUAL_HEX16(DERATING_REQUEST, y.derating);
    }
}

/* Driving torque acts in the direction of rotation, regenerating torque against it: four quadrants. */
void test_driving_and_regenerating_are_limited_separately_in_both_directions_of_rotation(void)
{
    limits.torque_drive = 5000;
    limits.torque_regen = 3000;
    static const int expected[4][3] = {{1, 8000, 5000}, {1, -8000, -3000}, {-1, -8000, -5000}, {-1, 8000, 3000}};
    for (int n = 0; n < 4; n++) {
        in.omega = (q15_t)(expected[n][0] * 16384);
        in.torque_arbitrated = (q15_t)expected[n][1];
        const torque_limit_t y = step();
        TEST_ASSERT_EQUAL_INT(expected[n][2], y.torque_limited);
        TEST_ASSERT_EQUAL_HEX16(DERATING_REQUEST, y.derating);
    }
}

/* p = t w: a power of 0.1 at half speed is a torque of 0.2; the loss is still 0. */
void test_a_power_limit_divided_by_the_speed_limits_the_torque(void)
{
    limits.power_drive = counts(0.1);
    limits.power_regen = counts(0.05);
    TEST_ASSERT_INT_WITHIN(2, counts(0.2), step().torque_limited);
    TEST_ASSERT_EQUAL_HEX16(DERATING_POWER, step().derating);
    in.torque_arbitrated = counts(-0.25);
    TEST_ASSERT_INT_WITHIN(2, counts(-0.1), step().torque_limited);
    in.omega = 1000; /* slow: the same power does not limit */
    TEST_ASSERT_EQUAL_INT(counts(-0.25), step().torque_limited);
}

/* The loss is u.i - t w = 0.2 * 0.5 - 0 = 0.1, plus drop |i| = 0.004 * 0.5. It reduces the shaft power that the battery
 * allows when driving and increases it when regenerating. After 100 steps of 0.05 the filter has settled to 0.6 %. */
void test_the_power_limits_apply_to_the_dc_side(void)
{
    in.u = (dq_q15_t){0, counts(0.2)};
    in.i = (dq_q15_t){0, counts(0.5)};
    for (int n = 0; n < 100; n++) {
        (void)step();
    }
    limits.power_drive = counts(0.15);
    limits.power_regen = counts(0.01);
    TEST_ASSERT_INT_WITHIN(60, counts((0.15 - 0.102) / 0.5), step().torque_limited);
    in.torque_arbitrated = counts(-0.25);
    TEST_ASSERT_INT_WITHIN(60, counts(-(0.01 + 0.102) / 0.5), step().torque_limited);
}

void test_a_power_below_the_losses_allows_no_driving_torque(void)
{
    state.loss = 300000000; /* 0.14 */
    limits.power_drive = counts(0.1);
    TEST_ASSERT_EQUAL_INT(0, step().torque_limited);
    limits.power_drive = -1000;
    TEST_ASSERT_EQUAL_INT(0, step().torque_limited);
}

/* In the middle of each derating line half the rated torque remains: 9830. */
static void assert_halved(uint16_t reason, int driving, int regenerating)
{
    in.torque_arbitrated = 15000;
    const torque_limit_t up = step();
    in.torque_arbitrated = -15000;
    const torque_limit_t down = step();
    TEST_ASSERT_INT_WITHIN(20, driving ? RATED / 2 : 15000, up.torque_limited);
    TEST_ASSERT_INT_WITHIN(20, regenerating ? -RATED / 2 : -15000, down.torque_limited);
    TEST_ASSERT_EQUAL_HEX16(driving ? reason : 0, up.derating);
    TEST_ASSERT_EQUAL_HEX16(regenerating ? reason : 0, down.derating);
}

void test_in_the_middle_of_the_inverters_derating_line_both_directions_are_halved(void)
{
    in.inverter_dC = 950;
    assert_halved(DERATING_INVERTER, 1, 1);
}

void test_in_the_middle_of_the_windings_derating_line_both_directions_are_halved(void)
{
    in.winding_dC = 1675;
    assert_halved(DERATING_WINDING, 1, 1);
}

void test_low_dc_voltage_limits_driving_torque_only(void)
{
    in.v_dc = 10240;
    assert_halved(DERATING_DC_LOW, 1, 0);
}

void test_high_dc_voltage_limits_regenerating_torque_only(void)
{
    in.v_dc = 26500;
    assert_halved(DERATING_DC_HIGH, 0, 1);
}

void test_near_maximum_speed_only_driving_torque_is_limited(void)
{
    in.omega = 29000;
    assert_halved(DERATING_SPEED, 1, 0);
    in.omega = -29000;
    in.torque_arbitrated = 15000; /* brakes */
    TEST_ASSERT_EQUAL_INT(15000, step().torque_limited);
}

void test_from_the_end_of_a_derating_line_on_the_torque_is_zero_and_nothing_wraps(void)
{
    static const int16_t hot[] = {1050, 2000, INT16_MAX};
    for (int n = 0; n < 3; n++) {
        in.inverter_dC = hot[n];
        TEST_ASSERT_EQUAL_INT(0, step().torque_limited);
    }
    in.inverter_dC = INT16_MIN + 2;
    TEST_ASSERT_EQUAL_INT(counts(0.25), step().torque_limited);
}

void test_a_missing_temperature_sensor_does_not_limit_and_a_lost_one_halves_the_torque(void)
{
    in.torque_arbitrated = 15000;
    in.inverter_dC = TEMPERATURE_UNKNOWN;
    in.winding_dC = TEMPERATURE_UNKNOWN;
    TEST_ASSERT_EQUAL_INT(15000, step().torque_limited);
    in.winding_dC = AMBIENT_C;
    (void)step();
    in.winding_dC = TEMPERATURE_UNKNOWN;
    TEST_ASSERT_INT_WITHIN(1, RATED / 2, step().torque_limited);
    TEST_ASSERT_EQUAL_HEX16(DERATING_SENSOR, step().derating);
}

/* From the first step on, with either sensor. */
void test_a_temperature_sensor_out_of_its_range_halves_the_torque_and_is_reported(void)
{
    in.torque_arbitrated = 15000;
    in.inverter_dC = TEMPERATURE_UNKNOWN;
    in.winding_dC = TEMPERATURE_OUT_OF_RANGE;
    TEST_ASSERT_INT_WITHIN(1, RATED / 2, step().torque_limited);
    TEST_ASSERT_EQUAL_HEX16(DERATING_SENSOR, step().derating);
    in.winding_dC = AMBIENT_C;
    in.inverter_dC = TEMPERATURE_OUT_OF_RANGE;
    TEST_ASSERT_EQUAL_HEX16(DERATING_SENSOR, step().derating);
    in.inverter_dC = AMBIENT_C;
    TEST_ASSERT_EQUAL_INT(15000, step().torque_limited);
}

void test_the_torque_is_limited_to_the_reach_of_the_machine(void)
{
    in.reach = 4000;
    TEST_ASSERT_EQUAL_INT(4000, step().torque_limited);
    in.torque_arbitrated = -8000;
    TEST_ASSERT_EQUAL_INT(-4000, step().torque_limited);
    TEST_ASSERT_EQUAL_HEX16(DERATING_REACH, step().derating);
    in.torque_arbitrated = 100;
    TEST_ASSERT_EQUAL_HEX16(0, step().derating);
}

/* Holding a vehicle on a slope must not depend on the direction in which it rolls: near standstill the driving limit
 * holds for both signs of the torque. */
void test_near_standstill_the_driving_limit_holds_for_both_signs_and_the_limit_is_continuous(void)
{
    limits.torque_drive = 8000;
    limits.torque_regen = 2000;
    in.torque_arbitrated = -15000;
    int last = 8000;
    for (int w = 0; w <= 700; w++) {
        in.omega = (q15_t)w;
        const int now = -step().torque_limited;
        TEST_ASSERT_TRUE(now <= last && last - now <= 25); /* 6000 over 300 counts */
        last = now;
    }
    TEST_ASSERT_EQUAL_INT(2000, last);
    in.omega = 0;
    TEST_ASSERT_EQUAL_INT(-8000, step().torque_limited);
    in.torque_arbitrated = 15000;
    TEST_ASSERT_EQUAL_INT(8000, step().torque_limited);
}

/* Tolerance: half an LSB of power divided by |w| >= 0.02, and 2 LSB of the loss. */
void test_the_limit_follows_the_twin(void)
{
    worst_t worst = {0};
    uint64_t seed = 99;
    twin_limit_state_t t_state = {0};
    const double power = 1.5 * f.v * f.i;
    f.si.torque_max_Nm = RATED / 32768.0 * f.t;
    for (int n = 0; n < 100000; n++) {
        limits = (torque_limits_t){(q15_t)random_in(&seed, 0, 25000), (q15_t)random_in(&seed, 0, 25000),
                                   (q15_t)random_in(&seed, 0, 25000), (q15_t)random_in(&seed, 0, 25000)};
        in = (torque_limit_in_t){
            .torque_arbitrated = (q15_t)random_in(&seed, -32767, 32767),
            .limits = &limits,
            .u = {random_in(&seed, -9000, 9000), random_in(&seed, -9000, 9000)},
            .i = {random_in(&seed, -20000, 0), random_in(&seed, -20000, 20000)},
            .torque_estimated = (q15_t)random_in(&seed, -3000, 3000),
            .omega = (q15_t)random_in(&seed, 650, 32767),
            .v_dc = (q15_t)random_in(&seed, 7000, 28000),
            .reach = (q15_t)random_in(&seed, 0, 25000),
            .inverter_dC = (int16_t)random_in(&seed, 0, 1200),
            .winding_dC = (int16_t)random_in(&seed, 0, 2000),
        };
        in.omega = (n & 1) ? in.omega : (q15_t)-in.omega;
        const twin_limit_in_t t = {from_q15(in.torque_arbitrated) * f.t,
                                   from_q15(limits.torque_drive) * f.t,
                                   from_q15(limits.torque_regen) * f.t,
                                   from_q15(limits.power_drive) * power,
                                   from_q15(limits.power_regen) * power,
                                   {from_q15(in.u.d) * f.v, from_q15(in.u.q) * f.v},
                                   {from_q15(in.i.d) * f.i, from_q15(in.i.q) * f.i},
                                   from_q15(in.torque_estimated) * f.t,
                                   from_q15(in.omega) * f.w,
                                   from_q15(in.v_dc) * f.v,
                                   from_q15(in.reach) * f.t,
                                   in.inverter_dC / 10.0,
                                   in.winding_dC / 10.0};
        const double s = twin_torque_limit(&f.si, &t_state, &t);
        worst_note(&worst, step().torque_limited - s / f.t * 32768.0, "step %d, arbitrated %d, w %d", n,
                   in.torque_arbitrated, in.omega);
    }
    ASSERT_WORST(worst, 60.0);
}

void test_derating_lines_with_the_wrong_sign_and_other_bad_configurations_are_rejected(void)
{
    TEST_ASSERT_EQUAL_INT(MOTOR_CHECK_OK, torque_limit_check(&f.torque_limit));
    torque_limit_config_t c = f.torque_limit;
    c.torque_max = 1;
    c.drop = 0;
    c.loss_rate = 1;
    c.moving.gain = c.dc_low.gain = 1;
    TEST_ASSERT_EQUAL_INT(MOTOR_CHECK_OK, torque_limit_check(&c)); /* the least of each */
    c.drop = -1;
    TEST_ASSERT_EQUAL_INT(MOTOR_CHECK_TORQUE_LIMIT, torque_limit_check(&c));
    c = f.torque_limit;
    c.moving.gain = 0;
    TEST_ASSERT_EQUAL_INT(MOTOR_CHECK_DERATING_STANDSTILL, torque_limit_check(&c));
    c = f.torque_limit;
    c.dc_low.gain = 0;
    TEST_ASSERT_EQUAL_INT(MOTOR_CHECK_DERATING_DC_LOW, torque_limit_check(&c));
    c = f.torque_limit;
    c.winding.gain = 1;
    TEST_ASSERT_NOT_EQUAL_INT(MOTOR_CHECK_OK, torque_limit_check(&c));
    c = f.torque_limit;
    c.dc_low.gain = -1;
    TEST_ASSERT_NOT_EQUAL_INT(MOTOR_CHECK_OK, torque_limit_check(&c));
    c = f.torque_limit;
    c.torque_max = 0;
    TEST_ASSERT_NOT_EQUAL_INT(MOTOR_CHECK_OK, torque_limit_check(&c));
    c = f.torque_limit;
    c.loss_rate = 0;
    TEST_ASSERT_NOT_EQUAL_INT(MOTOR_CHECK_OK, torque_limit_check(&c));
}
