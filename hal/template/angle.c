/* SPDX-License-Identifier: Apache-2.0 */
#include "hal/angle.h"

/* Write: read the encoder's counter or the resolver's angle that was captured together with the currents, and scale it
 * to 2^32 per mechanical turn. */
uint32_t hal_angle_read(void)
{
    return 0;
}

/* Write: true for a resolver or an absolute encoder; for an incremental encoder from the time its index has passed and
 * hal_angle_read() counts from it. Until then torque is refused. */
bool hal_angle_is_absolute(void)
{
    return false;
}
