/* SPDX-License-Identifier: Apache-2.0 */
/* The image: one drive on a bus, and the interrupts that run it. */
#include <stdbool.h>
#include <stdint.h>

#include "ecu/ecu.h"
#include "handlers.h"
#include "signal/crc32.h"

/* From the linker script: the motor's data, and the checksum that the build writes behind them. */
extern const uint8_t protected_start[], protected_end[];
__attribute__((section(".protected_crc"), used)) const volatile uint32_t protected_crc = 0xFFFFFFFFU;

ecu_t ecu; /* calibration tools find it by this name */

/* Write: clear the interrupt's flag if the hardware does not do so. */
void period_handler(void)
{
    fast_isr(&ecu.drive);
}

void mrai_handler(void)
{
    mrai_isr(&ecu.drive);
}

void task_handler(void)
{
    ecu_task_1khz(&ecu);
}

/* Write: clocks; pins, with the gate outputs off; converter, angle sensor, CAN, temperatures; the PWM timer's period
 * and dead time from motor.bases.period_s and motor.dead_time_s; the interrupts' priorities. */
static void init_hardware(void)
{
}

/* Write: start the PWM timer and, in step with it, the timer of the task. */
static void start_timers(void)
{
}

static bool data_are_intact(void)
{
    return crc32(protected_start, (uint32_t)(protected_end - protected_start)) == protected_crc;
}

int main(void)
{
    const bool intact = data_are_intact();
    ecu_init(&ecu, &motor);
    drive_refuse(&ecu.drive, intact ? MOTOR_CHECK_OK : MOTOR_CHECK_IMAGE_CHECKSUM);
    init_hardware();
    if (intact) {
        start_timers();
    }
    for (;;) {
        /* Write: background work, such as repeating the checksum, and memory_background(). */
    }
}
