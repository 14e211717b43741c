/* SPDX-License-Identifier: Apache-2.0 */
#ifndef LOOP_HEALTHY_SPREAD_H
#define LOOP_HEALTHY_SPREAD_H
/** Machine, inverter and sensors with the spread of a production: that of the campaigns in tests/loop/campaign.
 * Context  simulation only, after vehicle_start() */
#include "dice.h"
#include "vehicle.h"

void spread_draw(vehicle_t *vehicle, dice_t *dice);

#endif
