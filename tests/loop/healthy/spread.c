/* SPDX-License-Identifier: Apache-2.0 */
#include "spread.h"

#include <math.h>

#define DEGREE 0.017453292519943295
#define TURN 6.283185307179586
#define HIGH_VOLTAGE_V 100.0

static double now(const vehicle_t *vehicle, const char *name)
{
    return sim_get(vehicle->sim, name);
}

static void scale(vehicle_t *vehicle, dice_t *dice, const char *name, double low, double high)
{
    vehicle_set(vehicle, name, now(vehicle, name) * dice_between(dice, low, high));
}

static void draw(vehicle_t *vehicle, dice_t *dice, const char *name, double low, double high)
{
    vehicle_set(vehicle, name, dice_between(dice, low, high));
}

/* The resistance follows the winding's temperature, which is known to 5 degrees. */
static void draw_machine(vehicle_t *vehicle, dice_t *dice)
{
    const double per_K = now(vehicle, "plant.r_temp_coeff_per_K");
    const double warmer = dice_between(dice, 0.9, 1.5);
    const double told_C = 20.0 + ((per_K > 0.0) ? (warmer - 1.0) / per_K : 0.0) + dice_between(dice, -5.0, 5.0);
    const double r_ohm = now(vehicle, "plant.r_ohm_20") * warmer;
    vehicle_set(vehicle, "plant.winding_C", told_C);
    vehicle_set(vehicle, "plant.r_ohm_20", r_ohm / (1.0 + per_K * (told_C - 20.0)));
    scale(vehicle, dice, "plant.lq_scale", 0.9, 1.1);
    scale(vehicle, dice, "plant.ld_slope_scale", 0.9, 1.1);
    scale(vehicle, dice, "plant.magnet_scale", 0.8, 1.05);
}

static void draw_inverter(vehicle_t *vehicle, dice_t *dice)
{
    const bool high = now(vehicle, "plant.vdc_V") > HIGH_VOLTAGE_V;
    const double drop_V = now(vehicle, "plant.device_drop_V");
    scale(vehicle, dice, "plant.dead_time_s", 0.8, 1.2);
    vehicle_set(vehicle, "plant.device_drop_V",
                fmax(0.0, drop_V + (high ? dice_between(dice, -0.5, 0.5) : dice_between(dice, 0.0, 0.02))));
}

static void draw_sensors(vehicle_t *vehicle, dice_t *dice)
{
    const char *const gains[3] = {"plant.current_gain_a", "plant.current_gain_b", "plant.current_gain_c"};
    const char *const offsets[3] = {"plant.current_offset_A_a", "plant.current_offset_A_b", "plant.current_offset_A_c"};
    const double full_scale_A = now(vehicle, "plant.current_full_scale_A");
    for (int phase = 0; phase < 3; phase++) {
        draw(vehicle, dice, gains[phase], 0.995, 1.005);
        draw(vehicle, dice, offsets[phase], -0.002 * full_scale_A, 0.002 * full_scale_A);
    }
    vehicle_set(vehicle, "plant.current_noise_A_rms", 0.002 * full_scale_A);
    vehicle_set(vehicle, "plant.adc_bits", 12.0);
    draw(vehicle, dice, "plant.vdc_gain", 0.995, 1.005);
    vehicle_set(vehicle, "plant.angle_bits", 12.0);
    draw(vehicle, dice, "plant.angle_offset_rad", -0.5 * DEGREE, 0.5 * DEGREE);
    draw(vehicle, dice, "plant.angle_h1_rad", 0.0, DEGREE);
    draw(vehicle, dice, "plant.angle_h1_phase", 0.0, TURN);
    draw(vehicle, dice, "plant.angle_h2_rad", 0.0, DEGREE);
    draw(vehicle, dice, "plant.angle_h2_phase", 0.0, TURN);
}

void spread_draw(vehicle_t *vehicle, dice_t *dice)
{
    draw_machine(vehicle, dice);
    draw_inverter(vehicle, dice);
    draw_sensors(vehicle, dice);
}
