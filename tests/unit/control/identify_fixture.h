/* SPDX-License-Identifier: Apache-2.0 */
#ifndef UNIT_CONTROL_IDENTIFY_FIXTURE_H
#define UNIT_CONTROL_IDENTIFY_FIXTURE_H
/** The machine of fixture.h with priors for the identification, and windows of its steady state. */
#include "control/identify/record.h"
#include "fixture.h"
#include "twin/twin_identify.h"

/* Fills the configuration and the twin's data in f->si; ten periods in a window. */
void identify_fixture(fixture_t *f, identify_config_t *config);
/* The same with the given number of periods in a window of 1 ms. */
void identify_fixture_of(fixture_t *f, identify_config_t *config, int periods);

typedef struct {
    identify_window_t fixed;
    twin_window_t twin;
} window_pair_t;

identify_tables_t tables_at(const fixture_t *f, dq_q15_t i_m);

/* i in q15, speed per unit; extra_u is added to the voltage that the tables require. */
window_pair_t steady_window(const fixture_t *f, dq_q15_t i, double omega_pu, dq_q15_t extra_u);

/* Mean of psi x i over a period at whose ends the machine has psi and i_m, per unit. The voltage is constant within the
 * period, so that the stator flux moves along a chord; the mean is a sum over this chord, with currents from the
 * tables' inductances. */
double mean_on_the_chord(const fixture_t *f, dq_q15_t i_m, double psi_d, double psi_q, double omega_pu);

#endif
