/* SPDX-License-Identifier: Apache-2.0 */
#include "hal/shut_off.h"

/* The reference board has no external watchdog. A board that has one, for example a safety supply on LPSPI1, replaces
 * this file: README.md, external watchdog. */
bool hal_shut_off_question(uint8_t *question)
{
    (void)question;
    return false;
}

void hal_shut_off_answer(uint32_t answer)
{
    (void)answer;
}

bool hal_shut_off_supply(void)
{
    return false;
}
