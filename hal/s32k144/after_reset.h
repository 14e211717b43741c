/* SPDX-License-Identifier: Apache-2.0 */
#ifndef HAL_S32K144_AFTER_RESET_H
#define HAL_S32K144_AFTER_RESET_H
/** The first millisecond after a reset at speed: speed and dc voltage are measured on the internal oscillator, before
 * the crystal runs, and the short circuit is applied again if they require it and the retained RAM says that the bridge
 * had its supply. Contactor and gate supply, whose lines the reset has released, are switched on again.
 * Source   README.md, reset; docs/theory/safe-state.md, section 6
 * Context  after_reset_begin(): start-up, first; true: the short circuit is held, and pins and PWM are set up.
 *          after_reset_continue(): after drive_init(). after_reset_note(): 1 kHz task, at its end */
#include <stdbool.h>

#include "drive/drive.h"
#include "hal/s32k144/pwm.h"

bool after_reset_begin(const pwm_config_t *pwm);
void after_reset_continue(drive_t *drive);
void after_reset_note(const drive_t *drive);

#endif
