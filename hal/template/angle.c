/* SPDX-License-Identifier: Apache-2.0 */
#include "hal/angle.h"

/* Write: read the encoder's counter or the resolver's angle that was captured together with the currents, and scale it
 * to 2^32 per mechanical turn. */
uint32_t hal_angle_read(void)
{
    return 0;
}
