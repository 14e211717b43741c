/* SPDX-License-Identifier: Apache-2.0 */
#ifndef LOOP_HEALTHY_MANOEUVRES_H
#define LOOP_HEALTHY_MANOEUVRES_H
/** What a vehicle may do although it is harsh: nothing here is an error of the drive, and no monitor may end it.
 * Context  simulation only */
#include "driver.h"

/** Drives one manoeuvre of a random kind. False: a monitor has ended the drive. */
bool manoeuvre(driver_t *driver);

#endif
