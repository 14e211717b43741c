/* SPDX-License-Identifier: Apache-2.0 */
#include "second_level/own_torque.h"

#include "fx/lookup.h"
#include "fx/trig.h"

#define SPACING_SHIFT 11 /* a sixteenth */
#define MEAN_SHARE_MAX Q15(1.0 / 16.0)
#define LOSS_PART_MAX 5 /* a healthy machine may make a fifth less torque than the table */

typedef struct {
    int32_t d, q;
} current_t;

/* In the rotor frame (SL-3). Counts beyond the converter's width are impossible; they would saturate. */
static current_t rotor_current(const second_level_constants_t *constants, const second_level_sample_t *sample)
{
    const int32_t a = (int32_t)(sample->counts.i_a & 0xFFFFU);
    const int32_t b = (int32_t)(sample->counts.i_b & 0xFFFFU);
    const int32_t c = (int32_t)(sample->counts.i_c & 0xFFFFU);
    const q15_t alpha = fx_sat_q15(fx_mul_gain_q31(constants->alpha_per_count, 2 * a - b - c));
    const q15_t beta = fx_sat_q15(fx_mul_gain_q31(constants->beta_per_count, b - c));
    const uint32_t theta_e = constants->pole_pairs * sample->theta_m + constants->angle_offset;
    const fx_sincos_t at = fx_sincos((uint16_t)((theta_e + 0x8000U) >> 16));
    return (current_t){(fx_mul_q30(alpha, at.cos) + fx_mul_q30(beta, at.sin)) >> 15,
                       (fx_mul_q30(beta, at.cos) - fx_mul_q30(alpha, at.sin)) >> 15};
}

/* The torque by which the identified deviations of magnet and q axis reduce that of the table (SL-8). i_q: its
 * magnitude. */
static int32_t identified_loss(const second_level_constants_t *constants, const second_level_sample_t *sample,
                               int32_t i_d, q15_t i_q, int32_t table)
{
    const q15_t psi_d = fx_sat_q15(constants->psi_f + fx_mul_gain_q31(constants->l_d, i_d));
    const q15_t q_axis = fx_sat_q15(table - fx_mul_q15(psi_d, i_q));
    const int32_t change = fx_mul_q15(fx_sat_q15(sample->psi_d_error), i_q) +
                           fx_mul_q15(fx_sat_q15(sample->lq_error), q_axis);
    return fx_clamp_q31(change, -fx_max_s32(table, 0) / LOSS_PART_MAX, 0);
}

/* The torque that the mean over a period has less than the samples (SL-9). */
static int32_t mean_loss(const second_level_constants_t *constants, int32_t turn, q15_t i_q, int32_t at_samples)
{
    const int32_t turn_q16 = turn >> 16;
    const int32_t share = fx_mul_gain_q15_word(constants->mean_share, (turn_q16 * turn_q16) >> 16);
    const int32_t changing = 2 * at_samples - fx_mul_gain_q15_word(constants->mean_flux, i_q);
    return (fx_min_s32(share, MEAN_SHARE_MAX) * fx_max_s32(changing, 0)) >> 15;
}

int32_t second_level_own_torque(const second_level_constants_t *constants, const second_level_sample_t *sample,
                                int32_t turn)
{
    static const fx_grid_t grid = {-32768, 0, SPACING_SHIFT, SPACING_SHIFT, SECOND_LEVEL_ROWS, SECOND_LEVEL_COLUMNS};
    const current_t i = rotor_current(constants, sample);
    const int32_t q = fx_abs_q31(i.q);
    const q15_t i_q = fx_sat_q15(q);
    const fx_cell_t cell = fx_cell(&grid, i.d, q);
    const int32_t table = fx_cell_interp(constants->torque, SECOND_LEVEL_COLUMNS, cell);
    const int32_t at_samples = table + identified_loss(constants, sample, i.d, i_q, table);
    const int32_t magnitude = at_samples - mean_loss(constants, turn, i_q, at_samples);
    return (i.q < 0) ? -magnitude : magnitude;
}
