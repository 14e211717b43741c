/* SPDX-License-Identifier: Apache-2.0 */
#include "hal/shut_off.h"

/* Write: read the question of the external watchdog, and return true. */
bool hal_shut_off_question(uint8_t *question)
{
    (void)question;
    return false;
}

/* Write: transmit the answer. */
void hal_shut_off_answer(uint32_t answer)
{
    (void)answer;
}

/* Write: the line that reads back the gate supply. */
bool hal_shut_off_supply(void)
{
    return false;
}
