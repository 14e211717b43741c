/* SPDX-License-Identifier: Apache-2.0 */
#ifndef TWIN_STAGES_H
#define TWIN_STAGES_H
/** The control chain stage by stage in SI doubles: the reference for each fixed-point stage.
 *   Written from the equations of docs/theory; no header, format or scaling is shared with the firmware.
 * Source   docs/theory: current-control, angle-tracker, flux-tables, modulation, mrai, torque-loop, current-reference
 * Units    SI, peak phase quantities, electrical angles; the configuration of every stage is motor_si_t
 * Errors   none: a twin neither rounds nor saturates, except where the equation itself has a limit
 * Context  tests and simulation on a host */
#include <stdbool.h>

#include "twin/motor_si.h"

typedef struct {
    double a, b, c;
} twin_abc_t;

typedef struct {
    double alpha, beta;
} twin_ab_t;

typedef struct {
    double d, q;
} twin_dq_t;

/* --- transforms ------------------------------------------------------------------------------ */
twin_ab_t twin_clarke(twin_abc_t x);
twin_abc_t twin_clarke_inverse(twin_ab_t x);
twin_dq_t twin_park(twin_ab_t x, double theta_rad);
twin_ab_t twin_park_inverse(twin_dq_t x, double theta_rad);
double twin_wrap(double angle_rad); /* to [-pi, pi) */
double twin_clamp(double x, double lo, double hi);

/* Bilinear interpolation on a regular grid, row-major [ix * ny + iy]; beyond the grid the value at its edge. */
typedef struct {
    double x0, dx, y0, dy;
    int nx, ny;
} twin_grid_t;

double twin_lookup(const twin_grid_t *grid, const double *values, double x, double y);
bool twin_outside(const twin_grid_t *grid, double x, double y);

/* --- measurement and angle ------------------------------------------------------------------- */
typedef struct {
    double offset[3]; /* counts at zero current */
    double gain[3];
    double v_dc_gain;
} twin_measure_config_t;

typedef struct {
    twin_abc_t i;
    double v_dc;
} twin_measure_t;

/* counts: i_a, i_b, i_c, v_dc of a converter of motor->adc_bits. */
twin_measure_t twin_measure(const motor_si_t *motor, const twin_measure_config_t *config, const double counts[4]);

typedef struct {
    double theta, step; /* rad, rad per period */
    int samples;        /* the first two set angle and speed directly */
} twin_angle_state_t;

typedef struct {
    double theta, step, omega; /* measured angle; tracked advance per period and speed */
} twin_angle_t;

twin_angle_t twin_angle_tracker(const motor_si_t *motor, twin_angle_state_t *state, double theta_m_rad);

/* --- flux tables ----------------------------------------------------------------------------- */
typedef struct {
    double l_d, l_q, l_dd, l_qq; /* H */
    double g_d, g_q;             /* A per V and period: T_s/l_dd, T_s/l_qq */
    double psi_f0, psi_d, psi_q; /* V s, nominal magnet */
    bool clamped;
} twin_flux_t;

twin_flux_t twin_flux_table(const motor_si_t *motor, twin_dq_t i);

/* --- current control and modulation ---------------------------------------------------------- */
typedef struct {
    twin_dq_t s; /* V */
    bool limited;
} twin_current_state_t;

/* The current reference as flux linkage: psi for the integral part; weighted, which includes set-point weight,
 * resistive drop and rotational voltage, for the proportional part. */
typedef struct {
    twin_dq_t psi, weighted;
    double turn, integral_turn; /* rad/s: of the measured flux, and of the integral part */
} twin_target_t;

typedef struct {
    twin_target_t target;
    const twin_flux_t *flux; /* at the measured current */
    double omega, v_dc;
} twin_current_in_t;

/* r: flux whose rotational voltage the target makes. Before the first target it is the measured flux. */
typedef struct {
    twin_dq_t psi;
    bool behind;
} twin_rotating_t;

twin_target_t twin_current_target(const motor_si_t *motor, twin_dq_t i_ref, double omega, double psi_delta,
                                  twin_rotating_t *rotating);

twin_dq_t twin_current_control(const motor_si_t *motor, twin_current_state_t *state, const twin_current_in_t *in);

typedef struct {
    twin_dq_t s;         /* V */
    twin_dq_t now, next; /* V s: the model's flux at this sample and at the coming one */
    twin_dq_t unlimited; /* V, of the last step */
    bool limited;
} twin_turning_state_t;

typedef struct {
    twin_current_in_t control;
    twin_dq_t i;
    double step; /* advance of the angle, rad per period */
    double psi_delta;
} twin_turning_in_t;

/* The law of a motor whose field turns far in a period. */
void twin_turning_reset(twin_turning_state_t *state, const twin_flux_t *flux);
twin_dq_t twin_turning_control(const motor_si_t *motor, twin_turning_state_t *state, const twin_turning_in_t *in);

typedef struct {
    twin_dq_t u, i;
    double theta; /* the angle at the middle of the acting period */
    double v_dc;
} twin_modulate_in_t;

typedef struct {
    double duty[3];
    twin_dq_t applied;
    bool limited;
} twin_modulate_t;

twin_modulate_t twin_modulate(const motor_si_t *motor, const twin_modulate_in_t *in);

/* --- identification -------------------------------------------------------------------------- */
typedef struct {
    double flux_gain;       /* 2 k_psi/w, 0 holds the flux */
    double resistance_gain; /* 2 k_r/n, 0 holds the resistance */
    double voltage_scale;   /* 1/sinc(w T_s/2) */
} twin_mrai_schedule_t;

typedef struct {
    twin_dq_t i, u;
    twin_flux_t flux;
    double omega;
} twin_mrai_in_t;

typedef struct {
    twin_dq_t e;         /* observer error, V s */
    twin_mrai_in_t last; /* the sample at the start of the last period */
    double psi_delta, r_delta;
    double psi_used, r_used;
    bool psi_clamped, r_clamped;
} twin_mrai_state_t;

typedef struct {
    double psi_quality, r_quality;
    double psi_last, r_last; /* identified values at the last step */
} twin_mrai_quality_t;

void twin_mrai_reset(twin_mrai_state_t *state, const twin_mrai_in_t *in);
void twin_mrai(const motor_si_t *motor, const twin_mrai_schedule_t *schedule, twin_mrai_state_t *state,
               const twin_mrai_in_t *in);
twin_mrai_schedule_t twin_mrai_schedule(const motor_si_t *motor, twin_mrai_quality_t *quality_state,
                                        const twin_mrai_in_t *sample, const twin_mrai_in_t *next,
                                        const twin_mrai_state_t *identifier, bool enabled);

/* --- torque ---------------------------------------------------------------------------------- */
typedef struct {
    double sum, mean;
    int count;
} twin_torque_estimate_t;

double twin_torque(const motor_si_t *motor, twin_dq_t i, const twin_flux_t *flux, double psi_delta);
double twin_torque_estimate(const motor_si_t *motor, twin_torque_estimate_t *state, double torque_Nm);

/* A temperature that is NaN is unknown; a limit that is infinite has no effect. */
typedef struct {
    double torque_arbitrated, torque_drive, torque_regen, power_drive, power_regen;
    twin_dq_t u, i;
    double torque_estimated, omega, v_dc, reach, inverter_C, winding_C;
} twin_limit_in_t;

typedef struct {
    double loss_W;
    bool inverter_seen, winding_seen;
} twin_limit_state_t;

double twin_torque_limit(const motor_si_t *motor, twin_limit_state_t *state, const twin_limit_in_t *in);
double twin_i_d_limit(const motor_si_t *motor, double psi_delta, double winding_C);

typedef struct {
    double correction, model;
    bool saturated;
} twin_torque_state_t;

typedef struct {
    double torque_commanded, torque_estimated, confidence;
    bool enabled, limited;
} twin_torque_in_t;

double twin_torque_loop(const motor_si_t *motor, twin_torque_state_t *state, const twin_torque_in_t *in);

typedef struct {
    double torque_corrected, v_plan, omega, torque_limit, shift, psi_delta, i_d_max, psi_q_delta;
} twin_reference_in_t;

typedef struct {
    twin_dq_t i_ref;
    double torque_max, torque_limit, psi_plan;
    bool limited;
} twin_reference_t;

typedef struct {
    twin_dq_t u, psi; /* acting; the tables' flux at the last reference */
    double v_dc, psi_plan, psi_delta;
    bool acting;
} twin_reserve_in_t;

/* trim: the state. Returns |psi + dpsi| - |psi|. */
double twin_voltage_reserve(const motor_si_t *motor, double *trim, const twin_reserve_in_t *in);

twin_reference_t twin_current_reference(const motor_si_t *motor, const twin_reference_in_t *in);

/* i_m: magnetising current; admittance in A/Vs (CR-18), (CR-19). */
twin_dq_t twin_iron_loss(const motor_si_t *motor, twin_dq_t i_m, double admittance, twin_dq_t psi);

#endif
