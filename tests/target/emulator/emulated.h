/* SPDX-License-Identifier: Apache-2.0 */
#ifndef EMULATOR_EMULATED_H
#define EMULATOR_EMULATED_H
/** The emulated processor as a controller of the closed-loop runner: sensors to pins, compare values to the bridge,
 * one PWM period per step. Besides the names of the software-in-the-loop library:
 *   emulator.shadow        set 1: the same firmware, compiled for the host, runs in parallel with the same counts and
 *                          angles, and its state is compared after every period
 *   emulator.gate_fault, emulator.resolver_fault      pins, 0 or 1
 *   emulator.encoder_fault                            of an AS5047P, emu_encoder_fault_t; to be set only
 *   emulator.inverter_C, emulator.processor_C    temperatures of the second thermistor and of the sensor on the die
 *   emulator.board         set 1: the image's outputs control contactor, precharge, discharge and gate-driver supply
 *   emulator.power_cycle   set 1: the processor's supply fails and returns, the machine is not affected
 *   emulator.reset         set to bits of RCM_SRS: the processor is reset for this reason in the next period, after the
 *                          share emulator.reset_share of it; the plant continues while the image starts again. POR
 *                          (128): its supply has failed
 *   emulator.gates, .safe_state   read only: the bridge is switching or shorted; the board's hardware is asked for
 *                          its safe state
 *   emulator.compared, .differing, .instructions, .resets, .time_s, .dead_time_s, .pwm_period_s   read only
 * Source   docs/howto/emulate.md
 * Errors   sim_create_emulated(): NULL, error says why; sim_failure() names what stopped the emulation
 * Context  host */
#include "emu.h"
#include "loop/runner/sim.h"

EMU_API sim_t *sim_create_emulated(const char *elf, const char *layout, int mode, char *error, size_t size);
/** The emulated processor of a simulation. */
EMU_API emu_t *sim_emulator(sim_t *sim);
/** Where the shadow differed first ("part, period"); NULL: it has not differed. */
EMU_API const char *sim_shadow_difference(sim_t *sim);
/** Changes one bit of the shadow's state, to test that a difference is detected. */
EMU_API void sim_shadow_disturb(sim_t *sim);

#endif
