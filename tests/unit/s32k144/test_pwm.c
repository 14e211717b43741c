/* SPDX-License-Identifier: Apache-2.0 */
/* FTM0 with variables in place of registers: the tests check the written values, not the behaviour of the timer. */
#include <string.h>

#include "hal/pwm.h"
#include "hal/s32k144/core.h"
#include "hal/s32k144/pwm.h"
#include "hal/s32k144/registers.h"
#include "unity.h"

#define PERIOD 11200U
#define SIX_OUTPUTS 0x3FU

ftm_t fake_FTM0;
trgmux_t fake_TRGMUX;
nvic_t fake_nvic;
gpio_t fake_PTB, fake_PTD;

/* The levels that the pins read: bits 0 to 5, even ones are the upper outputs. */
static void set_levels(uint32_t levels)
{
    const uint32_t d = (levels & 3U) << 15 | (levels >> 2 & 3U), b = (levels >> 4 & 3U) << 4;
    memcpy((void *)(uintptr_t)&fake_PTD.PDIR, &d, sizeof d);
    memcpy((void *)(uintptr_t)&fake_PTB.PDIR, &b, sizeof b);
}

void setUp(void)
{
    fake_FTM0 = (ftm_t){0};
    fake_nvic = (nvic_t){0};
    set_levels(0);
    pwm_init(&(pwm_config_t){.period_ticks = PERIOD, .dead_time_ticks = 224});
}

void tearDown(void)
{
    hal_pwm_enable(false);
    (void)pwm_fault_reported();
}

void test_half_duty_is_a_pulse_in_the_middle_half_of_the_period(void)
{
    hal_pwm_write((duty_t){16384, 8192, 24576});
    TEST_ASSERT_EQUAL_UINT32(2800, FTM0->C0V);
    TEST_ASSERT_EQUAL_UINT32(8400, FTM0->C1V);
    TEST_ASSERT_EQUAL_UINT32(4200, FTM0->C2V);
    TEST_ASSERT_EQUAL_UINT32(7000, FTM0->C3V);
    TEST_ASSERT_EQUAL_UINT32(1400, FTM0->C4V);
    TEST_ASSERT_EQUAL_UINT32(9800, FTM0->C5V);
}

void test_no_duty_never_matches_and_full_duty_matches_at_the_start_only(void)
{
    hal_pwm_write((duty_t){0, 32768, 1});
    TEST_ASSERT_GREATER_THAN_UINT32(FTM0->MOD, FTM0->C0V);
    TEST_ASSERT_GREATER_THAN_UINT32(FTM0->MOD, FTM0->C1V);
    TEST_ASSERT_EQUAL_UINT32(0, FTM0->C2V);
    TEST_ASSERT_GREATER_THAN_UINT32(FTM0->MOD, FTM0->C3V);
    /* 1/32768 of 11200 ticks is a third of a tick and is rounded to zero. */
    TEST_ASSERT_GREATER_THAN_UINT32(FTM0->MOD, FTM0->C4V);
}

/* For every possible duty the pulse is within half a tick of duty * 11200, and within the period. */
void test_every_duty_gives_its_width_to_half_a_tick(void)
{
    for (uint32_t duty = 0; duty <= 32768U; duty++) {
        hal_pwm_write((duty_t){(uint16_t)duty, 16384, 16384});
        const uint32_t ticks = FTM0->C1V - FTM0->C0V;
        const double error = (double)ticks - (double)duty / 32768.0 * PERIOD;
        TEST_ASSERT_TRUE(error >= -0.5 && error <= 0.5);
        TEST_ASSERT_LESS_OR_EQUAL_UINT32(PERIOD, FTM0->C1V);
    }
}

void test_the_compare_values_take_effect_together_after_the_last(void)
{
    FTM0->SYNC = 0;
    hal_pwm_write((duty_t){1, 2, 3});
    TEST_ASSERT_EQUAL_HEX32(FTM_SYNC_CNTMAX | FTM_SYNC_SYNCHOM | FTM_SYNC_SWSYNC | FTM_SYNC_TRIG0, FTM0->SYNC);
}

void test_after_start_up_switching_is_disabled_and_the_configuration_locked(void)
{
    TEST_ASSERT_EQUAL_HEX32(SIX_OUTPUTS, FTM0->OUTMASK);
    TEST_ASSERT_EQUAL_HEX32(SIX_OUTPUTS, FTM0->SWOCTRL);
    TEST_ASSERT_EQUAL_UINT32(PERIOD - 1U, FTM0->MOD);
    TEST_ASSERT_EQUAL_HEX32(0, FTM0->FMS); /* not locked yet: otherwise the counter could not be started */
    pwm_start();
    TEST_ASSERT_BITS_HIGH(FTM_SC_CLKS(1), FTM0->SC);
    TEST_ASSERT_EQUAL_HEX32(FTM_FMS_WPEN, FTM0->FMS);
}

/* After switching has been disabled, duties are written in the same period. This must not clear the trigger that
 * applies the output mask. */
void test_duties_written_after_disabling_keep_the_trigger_of_the_output_mask(void)
{
    hal_pwm_enable(true);
    hal_pwm_enable(false);
    hal_pwm_write((duty_t){16384, 16384, 16384});
    TEST_ASSERT_BITS_HIGH(FTM_SYNC_TRIG0, FTM0->SYNC);
}

/* 2 us at 112 MHz: 224 = 3 * 64 + 32. */
void test_dead_time_beyond_six_bits_goes_to_the_extension(void)
{
    TEST_ASSERT_EQUAL_HEX32(3U << 16 | 32U, FTM0->DEADTIME);
}

/* 9 us at 112 MHz still fit (1008 ticks), 10 us do not: 1120 ticks = 280 steps of four; 1121 take one step more. */
void test_a_dead_time_beyond_ten_bits_is_counted_in_fours_and_never_too_short(void)
{
    pwm_init(&(pwm_config_t){.period_ticks = PERIOD, .dead_time_ticks = 1023});
    TEST_ASSERT_EQUAL_HEX32(15U << 16 | 63U, FTM0->DEADTIME);
    pwm_init(&(pwm_config_t){.period_ticks = PERIOD, .dead_time_ticks = 1120});
    TEST_ASSERT_EQUAL_HEX32(4U << 16 | 2U << 6 | 24U, FTM0->DEADTIME);
    pwm_init(&(pwm_config_t){.period_ticks = PERIOD, .dead_time_ticks = 1121});
    TEST_ASSERT_EQUAL_HEX32(4U << 16 | 2U << 6 | 25U, FTM0->DEADTIME);
}

void test_a_period_or_a_dead_time_that_the_timer_cannot_keep_is_impossible(void)
{
    TEST_ASSERT_TRUE(pwm_possible(&(pwm_config_t){11200, 224}));
    TEST_ASSERT_TRUE(pwm_possible(&(pwm_config_t){65532, 4092}));
    TEST_ASSERT_FALSE(pwm_possible(&(pwm_config_t){65536, 224}));
    TEST_ASSERT_FALSE(pwm_possible(&(pwm_config_t){11202, 224})); /* not a whole number of the tick timer's clocks */
    TEST_ASSERT_FALSE(pwm_possible(&(pwm_config_t){11200, 0}));   /* both switches of a phase on together */
    TEST_ASSERT_FALSE(pwm_possible(&(pwm_config_t){11200, 1401}));
    TEST_ASSERT_FALSE(pwm_possible(&(pwm_config_t){65532, 4093}));
}

/* All seven channels: an odd channel without an edge would leave its pin, the gate of a lower switch, undriven. */
void test_both_channels_of_every_pair_have_an_edge(void)
{
    const volatile uint32_t *const control[] = {&FTM0->C0SC, &FTM0->C1SC, &FTM0->C2SC, &FTM0->C3SC,
                                                &FTM0->C4SC, &FTM0->C5SC, &FTM0->C6SC};
    for (int k = 0; k < 7; k++) {
        TEST_ASSERT_EQUAL_HEX32(FTM_C0SC_ELSB, *control[k]);
    }
}

void test_sampling_by_software_keeps_switching_disabled_and_the_sample_line_with_the_timer(void)
{
    pwm_sample_by_hand();
    TEST_ASSERT_EQUAL_HEX32(SIX_OUTPUTS, FTM0->SWOCTRL);
}

void test_enabling_waits_for_the_period_and_disabling_does_not(void)
{
    hal_pwm_enable(true);
    TEST_ASSERT_EQUAL_HEX32(0, FTM0->OUTMASK);
    TEST_ASSERT_EQUAL_HEX32(0, FTM0->SWOCTRL);
    TEST_ASSERT_BITS_HIGH(FTM_SYNC_TRIG0 | FTM_SYNC_SYNCHOM, FTM0->SYNC);
    hal_pwm_enable(false);
    TEST_ASSERT_EQUAL_HEX32(SIX_OUTPUTS, FTM0->SWOCTRL);
    TEST_ASSERT_EQUAL_HEX32(SIX_OUTPUTS, FTM0->OUTMASK);
}

void test_an_unchanged_request_writes_no_register(void)
{
    hal_pwm_enable(true);
    FTM0->OUTMASK = 0x15;
    FTM0->SWOCTRL = 0x2A;
    hal_pwm_enable(true);
    TEST_ASSERT_EQUAL_HEX32(0x15, FTM0->OUTMASK);
    TEST_ASSERT_EQUAL_HEX32(0x2A, FTM0->SWOCTRL);
}

/* Switching is reported as enabled if one output of each pair is on, whatever was commanded. */
void test_the_gates_are_read_back_from_the_pins(void)
{
    TEST_ASSERT_FALSE(hal_pwm_gates());
    hal_pwm_enable(true);
    hal_pwm_enable(true); /* in the next period the outputs follow */
    TEST_ASSERT_FALSE(hal_pwm_gates());
    set_levels(0x26); /* upper b, lower a, lower c */
    TEST_ASSERT_TRUE(hal_pwm_gates());
    set_levels(0x06);
    TEST_ASSERT_FALSE(hal_pwm_gates());
    set_levels(0);
    TEST_ASSERT_FALSE(hal_pwm_gates());
}

void test_an_output_that_is_on_although_switching_is_disabled_is_reported(void)
{
    for (uint32_t output = 0; output < 6U; output++) {
        set_levels(1U << output);
        TEST_ASSERT_TRUE(hal_pwm_gates());
    }
}

/* In the period in which switching is enabled the outputs are still off; only the latch of the fault input tells. */
void test_in_the_period_of_enabling_the_latch_of_the_fault_input_decides(void)
{
    hal_pwm_enable(true);
    TEST_ASSERT_TRUE(hal_pwm_gates());
    FTM0->FMS = FTM_FMS_FAULTF | FTM_FMS_WPEN;
    TEST_ASSERT_FALSE(hal_pwm_gates());
    FTM0->FMS = FTM_FMS_WPEN;
    hal_pwm_enable(false);
    TEST_ASSERT_FALSE(hal_pwm_gates());
}

#define HELD 0x2A3FU

void test_a_short_circuit_is_held_by_software_until_the_counter_can_take_it_over(void)
{
    pwm_hold_short_circuit();
    TEST_ASSERT_EQUAL_HEX32(HELD, FTM0->SWOCTRL);
    TEST_ASSERT_EQUAL_HEX32(0, FTM0->OUTMASK);
    pwm_sample_by_hand();
    TEST_ASSERT_EQUAL_HEX32(HELD, FTM0->SWOCTRL);
    hal_pwm_enable(true); /* the duties of this period act in the next one */
    TEST_ASSERT_EQUAL_HEX32(HELD, FTM0->SWOCTRL);
    hal_pwm_enable(true);
    TEST_ASSERT_EQUAL_HEX32(0, FTM0->SWOCTRL);
    TEST_ASSERT_EQUAL_HEX32(0, FTM0->OUTMASK);
}

void test_a_short_circuit_held_by_software_is_ended_at_once(void)
{
    pwm_hold_short_circuit();
    hal_pwm_enable(false);
    TEST_ASSERT_EQUAL_HEX32(SIX_OUTPUTS, FTM0->SWOCTRL);
    TEST_ASSERT_EQUAL_HEX32(SIX_OUTPUTS, FTM0->OUTMASK);
}

void test_a_gate_fault_is_reported_once_to_the_board_and_masks_its_interrupt(void)
{
    pwm_gate_fault_isr();
    TEST_ASSERT_EQUAL_HEX32(1U << (IRQ_FTM0_FAULT & 31U), NVIC->ICER[IRQ_FTM0_FAULT >> 5]);
    TEST_ASSERT_TRUE(pwm_fault_reported());
    TEST_ASSERT_FALSE(pwm_fault_reported());
}

void test_a_fault_that_lasts_keeps_being_reported(void)
{
    FTM0->FMS = FTM_FMS_FAULTIN;
    TEST_ASSERT_TRUE(pwm_fault_reported());
    TEST_ASSERT_TRUE(pwm_fault_reported());
}

/* The safe state at speed enables switching in each period without disabling it before. */
void test_switching_that_a_fault_has_ended_is_enabled_again_when_the_line_allows_it(void)
{
    hal_pwm_enable(true);
    FTM0->FMS = FTM_FMS_FAULTF | FTM_FMS_WPEN;
    hal_pwm_enable(true);
    TEST_ASSERT_BITS_HIGH(FTM_FMS_FAULTF, FTM0->FMS); /* not before the interrupt has reported it */
    pwm_gate_fault_isr();
    FTM0->FMS = FTM_FMS_FAULTF | FTM_FMS_FAULTIN | FTM_FMS_WPEN;
    hal_pwm_enable(true);
    TEST_ASSERT_BITS_HIGH(FTM_FMS_FAULTF, FTM0->FMS);
    FTM0->FMS = FTM_FMS_FAULTF | FTM_FMS_WPEN;
    hal_pwm_enable(true);
    TEST_ASSERT_EQUAL_HEX32(FTM_FMS_WPEN, FTM0->FMS);
    TEST_ASSERT_EQUAL_HEX32(0, FTM0->OUTMASK);
    (void)pwm_fault_reported();
}

void test_enabling_clears_a_fault_only_when_it_has_ended(void)
{
    FTM0->FMS = FTM_FMS_FAULTF | FTM_FMS_FAULTIN | FTM_FMS_WPEN;
    hal_pwm_enable(true);
    TEST_ASSERT_BITS_HIGH(FTM_FMS_FAULTF, FTM0->FMS);
    hal_pwm_enable(false);
    FTM0->FMS = FTM_FMS_FAULTF | FTM_FMS_WPEN;
    hal_pwm_enable(true);
    TEST_ASSERT_EQUAL_HEX32(FTM_FMS_WPEN, FTM0->FMS);
    TEST_ASSERT_EQUAL_HEX32(1U << (IRQ_FTM0_FAULT & 31U), NVIC->ICPR[IRQ_FTM0_FAULT >> 5]);
    TEST_ASSERT_EQUAL_HEX32(1U << (IRQ_FTM0_FAULT & 31U), NVIC->ISER[IRQ_FTM0_FAULT >> 5]);
}
