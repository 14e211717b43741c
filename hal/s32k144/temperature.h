/* SPDX-License-Identifier: Apache-2.0 */
#ifndef HAL_S32K144_TEMPERATURE_H
#define HAL_S32K144_TEMPERATURE_H
/** Temperatures of winding and inverter, converted in turn: each once in 8 steps, four steps apart. A thermistor
 * follows its heat sink in seconds, and a fault needs 110 steps (MN-5): more conversions would tell no more.
 * Source   README.md, temperatures
 * Units    steps of the 1 kHz task
 * Range    hal/temperature.h
 * Errors   a broken sensor is reported up to 8 steps later, by the values of hal/temperature.h
 * Context  1 kHz task, once per step, before hal_temperature_winding_dC() and hal_temperature_inverter_dC() */

#define TEMPERATURE_CYCLE_STEPS 8U
#define TEMPERATURE_WINDING_TURN 0U
#define TEMPERATURE_INVERTER_TURN 4U

void temperature_tick(void);

#endif
