/* SPDX-License-Identifier: Apache-2.0 */
#ifndef IDENTIFY_CONFIG_H
#define IDENTIFY_CONFIG_H
/** Data of the robust identification: the machine's constants and their uncertainty before the first drive.
 * Source   docs/theory/identification.md; written by `tools/fluxtrue motor build` from [identification]
 * Units    per unit; sigma[k] is one standard deviation of the prior of state k
 * Range    identify_check() checks it at start-up
 * Errors   identify_check() names the first value that is not allowed
 * Context  const data */
#include <stdbool.h>

#include "fx/q.h"
#include "types/motor_check.h"

#define IDENTIFY_ONE_Q30 (1 << 30) /* the variance of a prior */

/** What is identified; each state is carried as a multiple of its prior's standard deviation. */
typedef enum {
    IDENTIFY_R = 0, /* resistance minus the prior's */
    IDENTIFY_DROP,  /* voltage along the current: dead time and device drop not compensated */
    IDENTIFY_FLUX,  /* magnet flux minus the table's */
    IDENTIFY_LQ,    /* scale of psi_q, minus one */
    IDENTIFY_LD,    /* scale of psi_d - psi_f0, minus one */
    IDENTIFY_ANGLE, /* measured minus true electrical angle, rad */
    IDENTIFY_IRON,  /* scale of the iron loss, minus one */
    IDENTIFY_STATES
} identify_index_t;

/** The flux depends on this state and on those behind it. */
#define IDENTIFY_FIRST_OF_FLUX IDENTIFY_FLUX

typedef struct {
    uint8_t l_shift;           /* of the flux tables */
    q31_t r0;                  /* at 20 C */
    q31_t r_per_dC;            /* r0 alpha/10: change per tenth of a degree */
    q31_t sinc_gain;           /* (omega_b T_s)^2/24 */
    int32_t mean_gain_q32;     /* 1/(2 N), N periods in a window: twice a sum to its mean */
    int32_t rate_gain_q28;     /* 1/(omega_b T), T = N periods, < 8 */
    uint32_t window_turns_q29; /* turns in T at omega_b, < 8 */
    q16_t turn_to_pu;          /* 1/(2 turns in T at omega_b): 2^-32 turn to q31 of omega_b */
    q31_t iron_hysteresis;     /* k_h/1.5 */
    q31_t iron_eddy;           /* k_e omega_b/1.5 */
    q16_t iron_sign_gain;      /* slope of the hysteresis term's sign through zero speed */
    q31_t sigma[IDENTIFY_STATES];
    q31_t leak[IDENTIFY_STATES]; /* per update: return of state and variance to the prior */
    int32_t r_known_q30;         /* prior variance of R, of sigma^2, while the winding temperature is measured */
    int32_t noise_voltage_q30, noise_flux_q30, noise_rate_q30; /* of the residuals' standard deviation */
    q15_t omega_min, i_min;                                    /* no parameter update below either */
    q15_t i_smooth;      /* below it the assumed voltage drop decreases with the current */
    q15_t local_corner;  /* speed at which voltage and flux errors weigh the same */
    q31_t local_rate;    /* of the local flux error's filter, per step; below 1/2 */
    q16_t limited_noise; /* share of the noise that each period with limited pulses adds: 5/N */
    q15_t mismatch_rate; /* first-order coefficient of the mismatch share, per update */
    q15_t torque_min;    /* the uncertainty is relative to the torque, and to this value at smaller torque */
    q15_t confidence_full,
        confidence_none;   /* relative torque uncertainty below which the confidence rises, above which it falls */
    q15_t confidence_rate; /* of the confidence, per update */
} identify_config_t;

motor_check_t identify_check(const identify_config_t *config);

#endif
