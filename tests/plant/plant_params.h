/* SPDX-License-Identifier: Apache-2.0 */
#ifndef PLANT_PLANT_PARAMS_H
#define PLANT_PLANT_PARAMS_H
/** The parameters of the simulated drive. All but those taken at creation may change between periods.
 * Source   docs/theory/plant.md
 * Units    SI; angles in radians, electrical where the comment says so; temperatures in degrees C
 * Errors   plant_params_bad_field() names what plant_create() refuses; later changes go unchecked
 * Context  simulation only */
#include <stdint.h>

/* What the gates do: imposed_bridge. */
enum { PLANT_BRIDGE_OBEYS = 0, PLANT_BRIDGE_OFF = 1, PLANT_BRIDGE_LOWER_ON = 2, PLANT_BRIDGE_UPPER_ON = 3 };

typedef struct {
    /* machine */
    double pole_pairs;
    int phases_swapped; /* the motor's leads b and c are exchanged: its field turns the other way */
    double r_ohm_20, r_temp_coeff_per_K, winding_C;          /* (PL-5) */
    double ld_H, lq_H, psi_f_Vs;                             /* used when there is no map */
    double magnet_scale;                                     /* of psi_f = psi_d(0, 0), (PL-4) */
    double magnet_temp_coeff_per_K, rotor_C;                 /* further factor on psi_f, (PL-4) */
    double lq_scale, ld_slope_scale, cross_saturation_scale; /* (PL-4) */
    double iron_k_h, iron_k_e;                               /* W/(rad/s Vs^2), W/(rad/s Vs)^2, (PL-8) */
    double iron_k_excess;                                    /* W/((rad/s)^1.5 Vs^2), (PL-28) */
    int magnet_step_keeps_current;                           /* 0: flux linkage is continuous; 1: current is, (PL-6) */
    /* inverter */
    double vdc_V, vdc_ripple_V, vdc_ripple_hz; /* of the battery */
    double pwm_hz, dead_time_s, device_drop_V;
    double leg_knee_A;               /* current at which a leg loses half of its error, (PL-29); 0: (PL-12) */
    double vdc_start_V;              /* of the dc link's capacitor, taken at creation */
    double vdc_least_V;              /* to which it discharges: the legs' errors are shares of it */
    double dc_link_F;                /* 0: no capacitor, the bridge is always connected to the battery */
    double precharge_s, discharge_s; /* time constants of the capacitor with the resistor of each */
    double dc_load_ohm;              /* resistor across the capacitor, a short circuit near 0; 0: none */
    double avalanche_V;              /* switches and diodes of the bridge conduct above it */
    int precharge_open, discharge_open, contactor_open; /* the switch does not close */
    double hardware_safe_V; /* the board shorts the phases above it while its safe state is requested; 0: it cannot */
    int substeps;           /* per PWM period, at least 10 */
    int ideal_inverter;     /* no dead time, no device drop */
    double series_d_V, series_q_V; /* source between inverter and machine: rotor frame, middle of the period (PL-27) */
    int phase_open[3];             /* the motor lead is broken */
    /* switches: upper a, b, c, lower a, b, c */
    int switch_open[6];     /* never switched on; its diode remains */
    int switch_shorted[6];  /* always conducts, in both directions */
    double short_circuit_A; /* current of a leg with one switch shorted and the other switched on */
    double desaturation_s;  /* time until the gate drivers block and report this current */
    int desaturation_open;  /* the gate drivers neither block nor report it */
    int drivers_block;      /* the gate drivers hold all six switches off and report it, for a fault of their own */
    int imposed_bridge;     /* PLANT_BRIDGE_..: whatever the controller wants, (PL-31) */
    /* sensors */
    double current_full_scale_A; /* the converter spans -full scale ... +full scale */
    int adc_bits;
    double current_gain[3], current_offset_A[3], current_noise_A_rms;
    int current_quantise;
    int current_stuck[3];       /* repeats its last sample */
    int current_open[3];        /* input pulled down: reads the negative full scale */
    double converter_reference; /* share of the nominal one: everything is read as if it were larger by its inverse */
    double known_voltage_gain;  /* error of the voltage that does not come from the reference */
    double vdc_full_scale_V, vdc_gain;
    double vdc_offset_V; /* shown without voltage; below 0 the converter shows 0 */
    int vdc_quantise;
    int angle_reversed;                  /* counts against the rotor */
    double angle_offset_rad;             /* electrical */
    double angle_h1_rad, angle_h1_phase; /* electrical amplitude, once per turn of the resolver */
    double angle_h2_rad, angle_h2_phase; /* the same, second harmonic */
    double resolver_pole_pairs;          /* resolver turns per mechanical turn */
    int angle_bits;                      /* of a mechanical turn; 0: not quantised */
    double angle_delay_s;
    int angle_stuck;
    int angle_sine_stuck, angle_cosine_stuck;   /* this track of the resolver keeps its value */
    int angle_length_check;                     /* the converter shows NaN for wrong tracks, (PL-33), (PL-34) */
    int angle_spike_every, angle_spike_samples; /* of every angle_spike_every samples, the first are wrong; 0: none */
    double angle_spike_rad;                     /* electrical: error of these samples */
    /* mechanics */
    int imposed_speed;
    double speed_rad_s;                        /* mechanical: the imposed speed, or the initial one */
    double theta_m_rad;                        /* initial rotor angle */
    double inertia_kgm2, load_Nm, viscous_Nms; /* load_Nm > 0 brakes a positive speed */
    double coulomb_Nm, stiction_Nm;            /* dry friction: at speed and at standstill, (PL-30) */
    double stribeck_rad_s;                     /* speed at which the former has replaced most of the latter */
    uint64_t seed;                             /* taken at creation */
} plant_params_t;

/** Neutral values: unit gains and scales, no imperfection, 10 substeps, speed imposed 0, 20 C.
 * Data of machine and inverter and the sensor ranges are 0; plant_create() refuses parameters without them. */
void plant_params_default(plant_params_t *params);

/** NULL when plant_create() would accept the parameters, else the name of the first bad field. */
const char *plant_params_bad_field(const plant_params_t *params, int has_map);

#endif
