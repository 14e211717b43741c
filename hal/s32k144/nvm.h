/* SPDX-License-Identifier: Apache-2.0 */
#ifndef HAL_S32K144_NVM_H
#define HAL_S32K144_NVM_H
/** The data flash behind hal/nvm.h: all 64 KiB of the FlexNVM, which must not be partitioned for the emulated EEPROM.
 *   nvm_init() keeps its content out of the code cache and of the flash's speculation buffer, so that a read after a
 *   command returns what the command has left.
 * Source   README.md, data flash
 * Context  start-up, before the first read */

void nvm_init(void);

#endif
