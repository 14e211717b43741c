/* SPDX-License-Identifier: Apache-2.0 */
/* The image: one drive, the interrupts that run it, and the background loop. */
#include <stdbool.h>
#include <stdint.h>

#include "ecu/ecu.h"
#include "fx/codegen.h"
#include "hal/angle.h"
#include "hal/s32k144/after_reset.h"
#include "hal/s32k144/angle.h"
#include "hal/s32k144/can.h"
#include "hal/s32k144/clock.h"
#include "hal/s32k144/core.h"
#include "hal/s32k144/image.h"
#include "hal/s32k144/nvm.h"
#include "hal/s32k144/pins.h"
#include "hal/s32k144/pwm.h"
#include "hal/s32k144/registers.h"
#include "hal/s32k144/sampling.h"
#include "hal/s32k144/startup.h"
#include "hal/s32k144/temperature.h"
#include "hal/s32k144/tick.h"
#include "hal/watchdog.h"
#include "storage/memory.h"

#define STACK_RESERVE 256U /* bytes at the end of the stack that must stay unused */
#define PERIPHERAL_PER_CORE (CLOCK_CORE_HZ / CLOCK_PERIPHERAL_HZ)

#if DIRECT
__asm__(".global commanded_directly\n.set commanded_directly, 1"); /* for tools; takes no memory */
#endif

ecu_t ecu;       /* calibration tools find it by this name */
memory_t memory; /* debuggers find it by this name */
/* For a counter that never runs, and the 1 kHz of the task. */
#define STOPPED_PERIODS 10U
static const pwm_config_t stopped = {11200, 1120};
/* Faults found by the gate driver's interrupt, the converters' interrupt and the background loop, and an angle that is
 * not absolute, found by the 1 kHz task. The fast ISR, which alone raises faults, reads them as one word. */
static volatile union {
    struct {
        bool gate_driver, sampling, data_damaged;
        bool angle_relative; /* the encoder's index has not passed */
    };
    uint32_t any;
} alarms;
static bool started; /* the PWM, and with it the fast ISR */

/* The gate driver's flag is cleared first and the fault raised afterwards, so that a fault in between is not lost.
 * Not inlined: alarms are rare. */
static FX_NOT_INLINED FX_COLD void alarms_take(void)
{
    if (alarms.gate_driver) {
        alarms.gate_driver = false;
        drive_raise_fault(&ecu.drive, FAULT_GATE); /* the outputs are off already */
    }
    if (alarms.sampling) {
        alarms.sampling = false;
        drive_raise_fault(&ecu.drive, FAULT_INPUT);
    }
    if (alarms.data_damaged) {
        drive_refuse(&ecu.drive, MOTOR_CHECK_IMAGE_CHECKSUM);
    }
    if (alarms.angle_relative) {
        drive_move_angle(&ecu.drive, angle_follow_index());
    }
}

/* With link-time optimisation the period is compiled into the handler. */
void adc_handler(void)
{
    if (alarms.any != 0U) {
        alarms_take();
    }
    fast_isr(&ecu.drive);
    if (angle_fault()) {
        drive_raise_fault(&ecu.drive, FAULT_ANGLE);
    }
}

/* If sampling keeps failing, no end of a conversion starts the fast ISR. It is pended here, so that it brings the drive
 * into its safe state. */
void sampling_error_handler(void)
{
    if (sampling_error_isr()) {
        alarms.sampling = true;
        core_irq_pend(IRQ_ADC0);
    }
}

void mrai_handler(void)
{
    mrai_isr(&ecu.drive);
}

/* The application services the watchdog only while the interrupts advance. With damaged data they never run; the
 * watchdog is then serviced here, so that the bus can report the fault. */
void tick_handler(void)
{
    tick_cleared();
    sampling_tick();
    temperature_tick();
    alarms.angle_relative = !hal_angle_is_absolute();
#if DIRECT
    hal_watchdog_service();
    task_1khz(&ecu.drive);
#else
    if (!started) {
        hal_watchdog_service();
    }
    ecu_task_1khz(&ecu);
#endif
    after_reset_note(&ecu.drive);
}

void can_message_handler(void)
{
    can_message_isr();
}

void can_bus_off_handler(void)
{
    can_bus_off_isr();
}

void gate_fault_handler(void)
{
    pwm_gate_fault_isr();
    alarms.gate_driver = true;
}

static void enable(uint32_t irq, uint32_t priority)
{
    core_irq_priority(irq, priority);
    core_irq_enable(irq);
}

static void enable_interrupts(void)
{
    enable(IRQ_FTM0_FAULT, PRIORITY_FAULT);
    enable(IRQ_ADC0, PRIORITY_FAST);
    enable(IRQ_PDB0, PRIORITY_FAST);
    enable(IRQ_PDB1, PRIORITY_FAST);
    enable(IRQ_MRAI, PRIORITY_MRAI);
    enable(IRQ_CAN0_ORED_0_15_MB, PRIORITY_CAN);
    enable(IRQ_CAN0_ORED, PRIORITY_CAN);
    enable(IRQ_LPIT0_CH0, PRIORITY_TICK);
}

static uint32_t ticks(float seconds)
{
    return (uint32_t)(seconds * (float)CLOCK_CORE_HZ + 0.5F);
}

/* False: the timer cannot make the period or dead time of the motor's data. */
static bool timing(pwm_config_t *pwm)
{
    const pwm_config_t wanted = {4U * ticks(motor.bases.period_s / 4.0F), ticks(motor.dead_time_s)};
    if (!pwm_possible(&wanted)) {
        return false;
    }
    *pwm = wanted;
    return true;
}

/* A short circuit that is held since the reset keeps its pins and its timer. */
static void init_hardware(const pwm_config_t *pwm, uint32_t periods_per_step, bool holds)
{
    clock_init();
    if (!holds) {
        pins_init();
        pwm_init(pwm);
    }
    sampling_init(pwm->period_ticks);
    tick_init(pwm->period_ticks / PERIPHERAL_PER_CORE, periods_per_step);
    can_init();
}

/* If the data are damaged, or the timer cannot make the period or the dead time, the counter and with it the fast ISR
 * never start. */
static void start(const pwm_config_t *pwm, bool drivable)
{
    __asm__ volatile("cpsid i" ::: "memory"); /* tick and PWM start together */
    angle_init(pwm->period_ticks);
    tick_start();
    if (drivable) {
        pwm_start();
        pins_offer_bridge();
#if DIRECT
        pins_keep_bridge(true); /* there is no state machine that decides it */
#endif
        started = true;
    }
    tick_continue();
    __asm__ volatile("cpsie i" ::: "memory");
}

/* The drive continues as after a fault at speed. */
static void continue_short_circuit(void)
{
    after_reset_continue(&ecu.drive);
#if !DIRECT
    ecu_continue(&ecu);
#endif
}

/* Separate from the reset handler, so that no floating-point instruction is moved before the FPU is enabled. What needs
 * time comes after the short circuit that a fast machine needs. */
FX_NOT_INLINED int main(void)
{
    pwm_config_t pwm = stopped;
    const bool possible = timing(&pwm);
    const bool was_held = possible && after_reset_begin(&pwm);
    alarms.data_damaged = !image_valid();
    ecu_init(&ecu, &motor);
    const bool drivable = possible && !alarms.data_damaged, holds = was_held && drivable;
    if (!drivable) {
        pwm = stopped;
        drive_refuse(&ecu.drive, alarms.data_damaged ? MOTOR_CHECK_IMAGE_CHECKSUM : MOTOR_CHECK_PWM_TIMER);
    }
    if (holds) {
        continue_short_circuit();
    }
    init_hardware(&pwm, drivable ? motor.bases.periods_per_step : STOPPED_PERIODS, holds);
    nvm_init();
    memory_recall(&memory, &ecu.drive);
    enable_interrupts();
#if DIRECT
    hal_watchdog_start();
#endif
    start(&pwm, drivable);
    for (;;) {
        if (!image_step()) {
            alarms.data_damaged = true;
        }
        if (stack_measure() < STACK_RESERVE) {
            panic();
        }
        (void)memory_background(&memory, &ecu.drive);
    }
}
