/* SPDX-License-Identifier: Apache-2.0 */
#include "fixture.h"

#include <math.h>
#include <stdarg.h>
#include <stdio.h>

#include "unity.h"
#include "worst.h"

/* Assumed data of an invented machine in a 350 V, 300 A, 10 kHz inverter. */
enum { NX = 15, NY = 15, NT = 9, NPSI = 9, POLE_PAIRS = 3, L_SHIFT = 2 };

#define V_RATIO 0.57

static const double period = 1e-4;
static const int cell = 2048; /* distance of the table nodes in counts of q15: 1/16 of the current base */

static int16_t l_d[NX * NY], l_q[NX * NY], l_qq[NX * NY], g[NX * NY];
static int16_t psi_f0[NX * NY], ref_d[NT * NPSI], ref_q[NT * NPSI], ref_max[NPSI];
static double si_l_d[NX * NY], si_l_q[NX * NY], si_l_dd[NX * NY], si_l_qq[NX * NY];
static double si_psi_f0[NX * NY], si_ref_d[NT * NPSI], si_ref_q[NT * NPSI], si_ref_max[NPSI];

static int16_t q15_of(double x)
{
    const double n = floor(x * 32768.0 + 0.5);
    return (int16_t)fmin(fmax(n, -32768.0), 32767.0);
}

static int32_t q31_of(double x)
{
    const double n = floor(x * 2147483648.0 + 0.5);
    return (int32_t)fmin(fmax(n, -2147483648.0), 2147483647.0);
}

static int32_t q16_of(double x)
{
    return (int32_t)floor(x * 65536.0 + 0.5);
}

static void bases(fixture_t *f)
{
    f->i = 300.0;
    f->v = 1.5 * 350.0;
    f->w = 1.25 * POLE_PAIRS * 10000.0 * 3.14159265358979323846 / 30.0;
    f->psi = f->v / f->w;
    f->z = f->v / f->i;
    f->l = f->z / f->w;
    f->t = 1.5 * POLE_PAIRS * f->psi * f->i;
}

/* Inductances that decrease with the current, all below 4 L_b. */
static void machine_at(double id, double iq, double l[4], double *flux)
{
    const double saturation = 1.0 / sqrt(1.0 + 4.0 * iq * iq);
    l[0] = 0.95 + 0.2 * id + 0.1 * iq;
    l[1] = 3.7 * saturation * (1.0 + 0.1 * id);
    l[2] = 0.95 + 0.4 * id + 0.1 * iq;
    l[3] = l[1] * saturation * saturation + 0.2;
    *flux = 0.53 - 0.12 * iq * iq;
}

static void flux_tables(fixture_t *f)
{
    for (int n = 0; n < NX * NY; n++) {
        double l[4];
        double flux;
        machine_at(-(NX - 1 - n / NY) / 16.0, (n % NY) / 16.0, l, &flux);
        l_d[n] = q15_of(ldexp(l[0], -L_SHIFT));
        l_q[n] = q15_of(ldexp(l[1], -L_SHIFT));
        l_qq[n] = q15_of(ldexp(l[3], -L_SHIFT));
        psi_f0[n] = q15_of(flux);
        const double scale = ldexp(f->l, L_SHIFT);
        si_l_d[n] = from_q15(l_d[n]) * scale;
        si_l_q[n] = from_q15(l_q[n]) * scale;
        si_l_dd[n] = l[2] * f->l;
        si_l_qq[n] = from_q15(l_qq[n]) * scale;
        si_psi_f0[n] = from_q15(psi_f0[n]) * f->psi;
        g[n] = q15_of(0.5 * period * f->z * (1.0 / si_l_dd[n] + 1.0 / si_l_qq[n]));
    }
    f->flux_table = (flux_table_config_t){
        .mesh = FX_MESH(-(NX - 1) * cell, 11U, (uint32_t)NX, (uint32_t)NY),
        .l_shift = L_SHIFT,
        .i_scale = 8 << L_SHIFT,
        .l_d = l_d,
        .l_q = l_q,
        .l_qq = l_qq,
        .g = g,
        .psi_f0 = psi_f0,
    };
    f->si.nd = NX;
    f->si.nq = NY;
    f->si.id0_A = -(NX - 1) / 16.0 * f->i;
    f->si.did_A = f->si.diq_A = f->i / 16.0;
    f->si.l_d_H = si_l_d;
    f->si.l_q_H = si_l_q;
    f->si.l_dd_H = si_l_dd;
    f->si.l_qq_H = si_l_qq;
    f->si.psi_f0_Vs = si_psi_f0;
}

/* Not an optimum, but similar to one: more negative i_d for more torque and for less flux. */
static void reference_tables(fixture_t *f)
{
    for (int ix = 0; ix < NT; ix++) {
        for (int iy = 0; iy < NPSI; iy++) {
            const int n = ix * NPSI + iy;
            const double t = ix / 16.0;
            const double psi = (iy + 2) / 16.0;
            ref_d[n] = q15_of(-0.5 * t - 0.2 * (0.7 - psi) * t);
            ref_q[n] = q15_of(1.1 * t - 0.2 * t * t);
            si_ref_d[n] = from_q15(ref_d[n]) * f->i;
            si_ref_q[n] = from_q15(ref_q[n]) * f->i;
            ref_max[iy] = q15_of(0.2 + 0.4 * psi);
            si_ref_max[iy] = from_q15(ref_max[iy]) * f->t;
        }
    }
    f->current_reference = (current_reference_config_t){
        .grid = {0, 2 * cell, 11, 11, NT, NPSI},
        .i_d = ref_d,
        .i_q = ref_q,
        .torque_max = ref_max,
        .r_q16 = 674,
        .i_max = q15_of(0.95),
    };
    f->si.ref_nt = NT;
    f->si.ref_npsi = NPSI;
    f->si.torque_step_Nm = f->t / 16.0;
    f->si.psi0_Vs = f->psi / 8.0;
    f->si.psi_step_Vs = f->psi / 16.0;
    f->si.ref_id_A = si_ref_d;
    f->si.ref_iq_A = si_ref_q;
    f->si.ref_torque_max_Nm = si_ref_max;
    f->si.ref_v_ratio = from_q15(q15_of(0.55));
    f->si.i_max_A = from_q15(q15_of(0.95)) * f->i;
    f->voltage_reserve = (voltage_reserve_config_t){
        .v_ratio = q15_of(0.55),
        .gain = q15_of(0.05),
        .trim_min = q15_of(-0.09),
        .trim_max = q15_of(0.075),
    };
    f->si.trim_gain = from_q15(q15_of(0.05));
    f->si.trim_min_V = from_q15(q15_of(-0.09)) * f->v;
    f->si.trim_max_ratio = from_q15(q15_of(0.075));
}

static void inputs(fixture_t *f)
{
    const double wn = 600.0 * period;
    const double turns = f->w * period / (2.0 * 3.14159265358979323846);
    f->angle_tracker = (angle_tracker_config_t){
        .pole_pairs = POLE_PAIRS,
        .kp = q31_of(2.0 * wn),
        .ki_q29 = q31_of(wn * wn / turns / 4.0),
        .pu_to_turn = q31_of(8.0 * turns),
        .turn_to_pu = q16_of(0.5 / turns),
        .max_step = 1u << 29,
        .repeat_max = POLE_PAIRS * (1u << 21),
        .lag_steps = 4,
        .stop_speed_q30 = (1 << 30) / 50,
        .stop_periods = 50,
    };
    f->si.pole_pairs = POLE_PAIRS;
    f->si.period_s = period;
    f->si.periods_per_step = 10;
    f->si.step_s = 10 * period;
    f->si.tracker_bandwidth_rad_s = 600.0;
    f->si.tracker_jump_turns = 0.125;
    f->si.r_ohm_20 = 674.0 / 65536.0 * f->z;
    f->si.psi_f_Vs = from_q15(psi_f0[0]) * f->psi;
    f->si.i_base_A = f->si.current_full_scale_A = f->i;
    f->si.v_base_V = f->v;
    f->si.omega_base_rad_s = f->w;
    f->si.v_dc_full_scale_V = 500.0;
    f->si.adc_bits = 12;
}

void fixture_dead_time(fixture_t *f, double duty)
{
    f->modulate.dead_time_q16 = 2 * q15_of(duty);
    f->si.dead_time_duty = from_q15(q15_of(duty));
}

void fixture_min_pulse(fixture_t *f, double duty)
{
    f->modulate.longest_q31 = (1 << 30) - 65536 * q15_of(duty);
    f->modulate.nearer_rail_q31 = (1 << 30) - 32768 * q15_of(duty);
    f->si.min_pulse_duty = from_q15(q15_of(duty));
}

static void voltage(fixture_t *f)
{
    const double sigma = 1.0 / (3.0 * period) / f->w;
    f->current_control = (current_control_config_t){
        .sigma_q24 = q31_of(sigma / 128.0),
        .drop_gain = q16_of(674.0 / 65536.0 / sigma),
        .setpoint_weight = q15_of(0.7),
        .integral_gain = q15_of(0.05 * sigma),
        .per_ratio_q31 = (uint32_t)lround(2147483648.0 / V_RATIO),
        .clear_q30 = (uint32_t)lround(1073741824.0 * 0.5 * 0.5 / V_RATIO / V_RATIO),
    };
    f->si.sigma_rad_s = f->current_control.sigma_q24 / 16777216.0 * f->w;
    f->si.setpoint_weight = from_q15(f->current_control.setpoint_weight);
    f->si.integral_ratio = from_q15(f->current_control.integral_gain) / (f->current_control.sigma_q24 / 16777216.0);
    f->si.v_ratio = V_RATIO;
    f->current_control.tracking_gain_q34 = q31_of(8.0 * f->si.integral_ratio / f->si.setpoint_weight * V_RATIO);
    f->modulate = (modulate_config_t){
        .alpha_q31 = q31_of(V_RATIO),
        .side_q31 = q31_of(V_RATIO * 0.86602540378443865),
        .knee_q17 = q16_of(200.0),
        .knee_side_q17 = q16_of(200.0 * 0.86602540378443865),
    };
    fixture_dead_time(f, 0.02);
    fixture_min_pulse(f, 0.01);
    f->si.knee_A = f->i / 100.0;
}

static void identification(fixture_t *f)
{
    const double r0 = 674.0 / 65536.0;
    const double m = 3.0, k_psi = 60.0, k_r = 20.0;
    f->mrai = (mrai_config_t){
        .r0 = q31_of(r0),
        .pole_gain = q31_of(4.0 * m * r0),
        .period = q31_of(f->w * period),
        .flux_gain = q31_of(2.0 * k_psi / f->w),
        .resistance_gain = q31_of(2.0 * k_r / f->w),
        .flux_proportional_q24 = 20 << 24,
        .resistance_proportional_q24 = 20 << 24,
        .psi_delta_min = q31_of(-0.25),
        .psi_delta_max = q31_of(0.125),
        .r_delta_min = q31_of(-0.5 * r0),
        .r_delta_max = q31_of(2.0 * r0),
        .omega_min = q15_of(0.05),
        .omega_r_max = q15_of(0.6),
        .i_min = q15_of(0.05),
        .sinc_gain = q31_of(f->w * period * f->w * period / 24.0),
        .psi_drift_full = q31_of(0.05 * from_q15(psi_f0[0]) * k_psi * 1e-3),
        .r_drift_full = q31_of(0.2 * r0 * k_r * 1e-3),
        .quality_rate = q15_of(0.02),
    };
    f->si.observer_m = m;
    f->si.flux_bandwidth_rad_s = k_psi;
    f->si.resistance_bandwidth_rad_s = k_r;
    f->si.flux_proportional = 20.0;
    f->si.resistance_proportional = 20.0;
    f->si.psi_delta_min_Vs = -0.25 * f->psi;
    f->si.psi_delta_max_Vs = 0.125 * f->psi;
    f->si.r_delta_min_ohm = from_q31(f->mrai.r_delta_min) * f->z;
    f->si.r_delta_max_ohm = from_q31(f->mrai.r_delta_max) * f->z;
    f->si.omega_min_rad_s = from_q15(f->mrai.omega_min) * f->w;
    f->si.omega_r_max_rad_s = from_q15(f->mrai.omega_r_max) * f->w;
    f->si.i_min_A = from_q15(f->mrai.i_min) * f->i;
    f->si.quality_rate = from_q15(f->mrai.quality_rate);
}

static void torque(fixture_t *f)
{
    f->torque_loop = (torque_loop_config_t){
        .ki = q15_of(0.03),
        .kp = q15_of(0.1),
        .model_rate = q15_of(0.25),
        .authority = q15_of(0.4),
        .torque_min = q15_of(0.02),
    };
    f->si.torque_ki = from_q15(f->torque_loop.ki);
    f->si.torque_kp = from_q15(f->torque_loop.kp);
    f->si.torque_model_rate = from_q15(f->torque_loop.model_rate);
    f->si.torque_authority = from_q15(f->torque_loop.authority);
    f->si.torque_min_Nm = from_q15(f->torque_loop.torque_min) * f->t;
    f->si.torque_max_Nm = 0.6 * f->t;
}

/* Derating from full torque at `start` to none at `end`, in counts. */
static derating_line_t line_of(int end, int start)
{
    return (derating_line_t){(q15_t)end, (q16_t)floor(2147483648.0 / (start - end) + 0.5)};
}

static void limits(fixture_t *f)
{
    const double volt = f->v / 32768.0;
    const double speed = f->w / 32768.0;
    f->torque_limit = (torque_limit_config_t){
        .torque_max = q15_of(0.6),
        .drop = q15_of(0.004),
        .loss_rate = q15_of(0.05),
        .moving = line_of(300, 600),
        .inverter = line_of(1050, 850),
        .winding = line_of(1800, 1550),
        .dc_low = line_of(8192, 12288),
        .dc_high = line_of(27000, 26000),
        .speed = line_of(30000, 28000),
    };
    f->si.loss_drop_V = from_q15(q15_of(0.004)) * f->v;
    f->si.loss_rate = from_q15(q15_of(0.05));
    f->si.moving_end_rad_s = 300 * speed;
    f->si.moving_start_rad_s = 600 * speed;
    f->si.speed_end_rad_s = 30000 * speed;
    f->si.speed_start_rad_s = 28000 * speed;
    f->si.inverter_end_C = 105.0;
    f->si.inverter_start_C = 85.0;
    f->si.winding_end_C = 180.0;
    f->si.winding_start_C = 155.0;
    f->si.dc_low_end_V = 8192 * volt;
    f->si.dc_low_start_V = 12288 * volt;
    f->si.dc_high_end_V = 27000 * volt;
    f->si.dc_high_start_V = 26000 * volt;
    /* 0.9 I_b at 20 C, 0.002 I_b less per K; psi_f (0.53 psi_b) decreases by 0.1 % per K. */
    f->i_d_limit = (i_d_limit_config_t){
        .i_20 = q15_of(0.9),
        .slope = q16_of(0.0002 * 32768.0),
        .i_max = q15_of(0.8),
        .dC_per_psi = q16_of(-10.0 / (0.53 * 0.001 * 32768.0)),
        .assumed_dC = 1500,
    };
    f->si.i_d_20_A = from_q15(q15_of(0.9)) * f->i;
    f->si.i_d_slope_A_per_K = 0.002 * f->i;
    f->si.psi_temp_coeff_per_K = -0.001;
    f->si.magnet_assumed_C = 150.0;
}

fixture_t fixture(void)
{
    fixture_t f = {0};
    bases(&f);
    flux_tables(&f);
    reference_tables(&f);
    inputs(&f);
    voltage(&f);
    identification(&f);
    torque(&f);
    limits(&f);
    return f;
}

void worst_note(worst_t *worst, double error, const char *format, ...)
{
    if ((worst->where[0] == '\0') || is_worse(fabs(error), worst->error)) {
        va_list arguments;
        va_start(arguments, format);
        (void)vsnprintf(worst->where, sizeof worst->where, format, arguments);
        va_end(arguments);
        worst->error = fabs(error);
    }
}

void worst_assert(const worst_t *worst, double tolerance, int line)
{
    char message[300];
    (void)snprintf(message, sizeof message, "%.6g off, allowed %.6g, at %s", worst->error, tolerance, worst->where);
    UNITY_TEST_ASSERT(worst->error <= tolerance, line, message);
}

uint32_t random_u32(uint64_t *state)
{
    uint64_t x = *state;
    x ^= x >> 12;
    x ^= x << 25;
    x ^= x >> 27;
    *state = x;
    return (uint32_t)((x * UINT64_C(0x2545F4914F6CDD1D)) >> 32);
}

int32_t random_in(uint64_t *state, int32_t lo, int32_t hi)
{
    const uint64_t span = (uint64_t)((int64_t)hi - lo) + 1U;
    return (int32_t)(lo + (int64_t)((random_u32(state) * span) >> 32));
}
