/* SPDX-License-Identifier: Apache-2.0 */
#include <math.h>
#include <stdlib.h>

#include "control/current/measure.h"
#include "fixture.h"
#include "unity.h"

/* Calibration data; configured() converts them to the configuration of the stage. */
static struct {
    int shift; /* 16 - adc_bits */
    int32_t offset[3], gain_q14[3];
    uint32_t v_dc_gain_q15;
    int32_t v_dc_offset_q15; /* of V_b */
} config;

/* A converter of 12 bits, whose counts are shifted left by 4; its mid-scale is 2048 counts. */
void setUp(void)
{
    config.shift = 4;
    config.v_dc_gain_q15 = 32768;
    config.v_dc_offset_q15 = 0;
    for (int x = 0; x < 3; x++) {
        config.offset[x] = 32768;
        config.gain_q14[x] = 16386; /* 1.0001, a multiple of 6: Q13 represents a third of it exactly */
    }
}

static measure_config_t configured(void)
{
    measure_config_t c = {
        .v_dc = {(int32_t)(config.v_dc_gain_q15 << config.shift) / 2, 0x4000 - config.v_dc_offset_q15 * 32768}};
    for (int x = 0; x < 3; x++) {
        const int32_t third = (x == 0) ? config.gain_q14[x] / 6 : -config.gain_q14[x] / 6; /* Q13 */
        c.phase[x].scale = third * (1 << config.shift);
        c.phase[x].bias = -config.offset[x] * third + ((x == 0) ? 2048 : 0);
    }
    return c;
}

static measure_t measured(const adc_counts_t *counts)
{
    const measure_config_t c = configured();
    return measure_step(&c, counts);
}

static abc_q15_t phases(const adc_counts_t *counts)
{
    const measure_t m = measured(counts);
    return measure_phases(fx_pair((q15_t)m.i.alpha, (q15_t)m.i.beta), m.zero_q28);
}

void tearDown(void)
{
}

void test_mid_scale_is_zero_current_and_the_ends_are_full_scale(void)
{
    const adc_counts_t low = {2048, 2048, 2048, 0};
    TEST_ASSERT_EQUAL_INT(0, measured(&low).i.alpha);
    TEST_ASSERT_EQUAL_INT(0, measured(&low).i.beta);
    TEST_ASSERT_EQUAL_INT(0, measured(&low).v_dc);
    const adc_counts_t ends = {0, 4095, 4095, 0}; /* (-2 - 1 - 1)/3 is below -1 and saturates */
    TEST_ASSERT_EQUAL_INT(-32768, measured(&ends).i.alpha);
    TEST_ASSERT_EQUAL_INT(0, measured(&ends).i.beta);
}

/* By hand: (2 * 1600 + 800 + 800)/3 without beta; with phase b alone -800/3 and 800/sqrt(3). zero_q28 is the mean of
 * the phases in Q28 plus a quarter LSB of q15. */
void test_the_current_vector_and_the_zero_sequence_match_their_definitions(void)
{
    const adc_counts_t balanced = {2048 + 100, 2048 - 50, 2048 - 50, 0};
    measure_t m = measured(&balanced);
    TEST_ASSERT_EQUAL_INT(1600, m.i.alpha);
    TEST_ASSERT_EQUAL_INT(0, m.i.beta);
    TEST_ASSERT_EQUAL_INT(2048, m.zero_q28);
    const adc_counts_t alone = {2048, 2048 + 50, 2048, 0};
    m = measured(&alone);
    TEST_ASSERT_EQUAL_INT(-267, m.i.alpha);
    TEST_ASSERT_EQUAL_INT(462, m.i.beta);
    TEST_ASSERT_INT_WITHIN(300, 800 * 8192 / 3 + 2048, m.zero_q28);
}

/* With a gain of 1.0 the full-scale voltage is V_b, and half scale is half of it. */
void test_the_dc_voltage_scales_with_its_gain(void)
{
    const adc_counts_t half = {2048, 2048, 2048, 2048};
    TEST_ASSERT_EQUAL_INT(16384, measured(&half).v_dc);
    config.v_dc_gain_q15 = 16384;
    TEST_ASSERT_EQUAL_INT(8192, measured(&half).v_dc);
    const adc_counts_t full = {2048, 2048, 2048, 4095};
    config.v_dc_gain_q15 = 65534;
    TEST_ASSERT_EQUAL_INT(32767, measured(&full).v_dc); /* 1.9995 V_b saturates */
}

/* Below the offset the voltage is 0 and not negative; the gain does not scale the offset, which is in units of V_b. */
void test_the_offset_of_the_dc_voltage_is_subtracted_once(void)
{
    config.v_dc_offset_q15 = 320; /* 80 counts */
    config.v_dc_gain_q15 = 16384;
    const struct {
        uint16_t count;
        int32_t v_dc;
    } cases[] = {{0, 0}, {79, 0}, {80, 0}, {81, 4}, {160, 320}, {2048, 8192 - 320}};
    for (size_t n = 0; n < sizeof cases / sizeof cases[0]; n++) {
        const adc_counts_t counts = {2048, 2048, 2048, cases[n].count};
        const measure_config_t c = configured();
        TEST_ASSERT_EQUAL_INT(cases[n].v_dc, measured(&counts).v_dc);
        TEST_ASSERT_EQUAL_INT(measured(&counts).v_dc, measure_v_dc(&c.v_dc, cases[n].count));
    }
    config.v_dc_offset_q15 = -320;
    const adc_counts_t none = {2048, 2048, 2048, 0}, most = {2048, 2048, 2048, 4095};
    TEST_ASSERT_EQUAL_INT(320, measured(&none).v_dc);
    config.v_dc_gain_q15 = 32768;
    TEST_ASSERT_EQUAL_INT(32767, measured(&most).v_dc); /* 32760 + 320 saturates */
}

void test_an_offset_and_a_gain_belong_to_their_own_phase(void)
{
    config.offset[1] = 32768 + 160;
    config.gain_q14[2] = 8190;
    const adc_counts_t counts = {2058, 2058, 2058, 0};
    const abc_q15_t i = phases(&counts);
    TEST_ASSERT_INT_WITHIN(1, 160, i.a);
    TEST_ASSERT_INT_WITHIN(1, 0, i.b);
    TEST_ASSERT_INT_WITHIN(1, 80, i.c);
}

static void compare_with_twin(worst_t *worst, int bits, const adc_counts_t *c)
{
    motor_si_t si = {.adc_bits = bits,
                     .current_full_scale_A = 32768.0,
                     .v_dc_full_scale_V = 32768.0,
                     .v_dc_offset_V = config.v_dc_offset_q15};
    const double lsb = 1 << config.shift;
    const twin_measure_config_t twin_config = {
        {config.offset[0] / lsb, config.offset[1] / lsb, config.offset[2] / lsb},
        {config.gain_q14[0] / 16384.0, config.gain_q14[1] / 16384.0, config.gain_q14[2] / 16384.0},
        config.v_dc_gain_q15 / 32768.0};
    const double counts[4] = {c->i_a, c->i_b, c->i_c, c->v_dc};
    const twin_measure_t t = twin_measure(&si, &twin_config, counts);
    const twin_ab_t vector = twin_clarke(t.i);
    const measure_t m = measured(c);
    const abc_q15_t i = phases(c);
    worst_note(worst, m.i.alpha - twin_clamp(vector.alpha, -32768, 32767), "alpha of %d %d %d", c->i_a, c->i_b, c->i_c);
    worst_note(worst, m.i.beta - twin_clamp(vector.beta, -32768, 32767), "beta of %d %d %d", c->i_a, c->i_b, c->i_c);
    worst_note(worst, (m.zero_q28 - 2048) * 3.0 / 8192.0 - (t.i.a + t.i.b + t.i.c), "sum of %d %d %d", c->i_a, c->i_b,
               c->i_c);
    worst_note(worst, m.v_dc - twin_clamp(t.v_dc, 0, 32767), "v_dc of %d", c->v_dc);
    /* The phases have five roundings: 2.2 LSB at most, 0.55 after the factor. */
    if (fabs(vector.alpha) < 32767.0 && fabs(vector.beta) < 32767.0) {
        worst_note(worst, 0.25 * (i.a - twin_clamp(t.i.a, -32768, 32767)), "i_a of %d %d %d", c->i_a, c->i_b, c->i_c);
        worst_note(worst, 0.25 * (i.b - twin_clamp(t.i.b, -32768, 32767)), "i_b of %d %d %d", c->i_a, c->i_b, c->i_c);
        worst_note(worst, 0.25 * (i.c - twin_clamp(t.i.c, -32768, 32767)), "i_c of %d %d %d", c->i_a, c->i_b, c->i_c);
    }
}

/* Tolerance: one rounding to q15, half an LSB; sqrt(3) in Q19 has an error of 1e-7. The gains are multiples of 6, so
 * that Q13 represents a third of each exactly. */
void test_every_count_with_random_offsets_and_gains_follows_the_twin(void)
{
    worst_t worst = {0};
    uint64_t seed = 21;
    for (int bits = 10; bits <= 16; bits++) {
        config.shift = (uint8_t)(16 - bits);
        for (int count = 0; count < (1 << bits); count += 1 + (1 << bits) / 4096) {
            for (int x = 0; x < 3; x++) {
                config.offset[x] = random_in(&seed, 0, 65535);
                config.gain_q14[x] = 6 * random_in(&seed, 1, 5461);
            }
            config.v_dc_gain_q15 = 2U * (uint32_t)random_in(&seed, 1, 32000);
            config.v_dc_offset_q15 = random_in(&seed, -1500, 1500); /* with the gain below 2 V_b */
            const uint16_t c = (uint16_t)count;
            const uint16_t other = (uint16_t)random_in(&seed, 0, (1 << bits) - 1);
            compare_with_twin(&worst, bits, &(adc_counts_t){c, c, c, c});
            compare_with_twin(&worst, bits, &(adc_counts_t){c, other, (uint16_t)(c ^ other), other});
        }
    }
    ASSERT_WORST(worst, 0.6);
}

void test_the_widest_product_neither_wraps_nor_changes_sign(void)
{
    worst_t worst = {0};
    config.shift = 0;
    for (int x = 0; x < 3; x++) {
        config.gain_q14[x] = 32766;
    }
    config.v_dc_gain_q15 = 65534;
    config.offset[0] = 0;
    config.offset[1] = 65535;
    compare_with_twin(&worst, 16, &(adc_counts_t){65535, 0, 65535, 65535});
    compare_with_twin(&worst, 16, &(adc_counts_t){0, 65535, 0, 0});
    ASSERT_WORST(worst, 0.6);
}

/* If a HAL delivers bits above the converter's width, the behaviour is defined: the current is wrong but in range. */
void test_counts_above_the_converters_width_still_give_a_current_within_range(void)
{
    const measure_t m = measured(&(adc_counts_t){65535, 65535, 65535, 65535});
    TEST_ASSERT_INT_WITHIN(32768, 0, m.i.alpha);
    TEST_ASSERT_EQUAL_INT(0, m.i.beta);
    TEST_ASSERT_INT_WITHIN(32768, 0, m.v_dc);
}

/* The phases are computed from alpha, beta and the zero sequence. The monitor of stuck sensors relies on 4 LSB as the
 * largest change of a phase whose converter repeats its counts while the other two move. */
void test_a_phase_whose_counts_repeat_changes_by_at_most_4_lsb(void)
{
    uint64_t seed = 23;
    int32_t largest = 0;
    for (int n = 0; n < 2000; n++) {
        const uint16_t count = (uint16_t)random_in(&seed, 1500, 2600);
        for (int x = 0; x < 3; x++) {
            abc_q15_t i[2];
            for (int k = 0; k < 2; k++) {
                uint16_t of[3];
                for (int y = 0; y < 3; y++) {
                    of[y] = (y == x) ? count : (uint16_t)random_in(&seed, 1500, 2600);
                }
                const adc_counts_t counts = {of[0], of[1], of[2], 0};
                i[k] = phases(&counts);
            }
            const int32_t change[3] = {i[1].a - i[0].a, i[1].b - i[0].b, i[1].c - i[0].c};
            largest = (abs(change[x]) > largest) ? abs(change[x]) : largest;
        }
    }
    TEST_ASSERT_INT_WITHIN(4, 0, largest);
    TEST_ASSERT_GREATER_THAN_INT(0, largest);
}
