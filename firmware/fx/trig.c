/* SPDX-License-Identifier: Apache-2.0 */
#include "fx/trig.h"

fx_pair_t fx_unit_vector(uint32_t turn)
{
    return fx_rotation(turn);
}
