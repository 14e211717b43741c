/* SPDX-License-Identifier: Apache-2.0 */
#include "second_level/own_torque.h"

#include "fx/lookup.h"
#include "fx/trig.h"

#define SPACING_SHIFT 11 /* a sixteenth */

int32_t second_level_own_torque(const second_level_constants_t *constants, const second_level_sample_t *sample)
{
    static const fx_grid_t grid = {-32768, 0, SPACING_SHIFT, SPACING_SHIFT, SECOND_LEVEL_ROWS, SECOND_LEVEL_COLUMNS};
    const uint32_t theta_e = constants->pole_pairs * sample->theta_m + constants->angle_offset;
    const fx_sincos_t at = fx_sincos((uint16_t)((theta_e + 0x8000U) >> 16));
    const q15_t alpha = fx_sat_q15(sample->alpha);
    const q15_t beta = fx_sat_q15(sample->beta);
    const int32_t i_d = (fx_mul_q30(alpha, at.cos) + fx_mul_q30(beta, at.sin)) >> 15;
    const int32_t i_q = (fx_mul_q30(beta, at.cos) - fx_mul_q30(alpha, at.sin)) >> 15;
    const fx_cell_t cell = fx_cell(&grid, i_d, fx_abs_q31(i_q));
    const int32_t magnitude = fx_cell_interp(constants->torque, SECOND_LEVEL_COLUMNS, cell);
    return (i_q < 0) ? -magnitude : magnitude;
}
