/* SPDX-License-Identifier: Apache-2.0 */
#ifndef VECU_MACHINE_DATA_H
#define VECU_MACHINE_DATA_H
/** The plant for the motor of the firmware: the parameters that the motor's data give, and its flux map.
 * Source   generated from motor.json by tools/fluxtrue_tools/vecu/emit.py
 * Units    SI; names of tests/loop/runner/sim.h
 * Context  simulation only */

typedef struct {
    const char *name;
    double value;
} machine_value_t;

typedef struct {
    const char *motor;
    const machine_value_t *values; /* ends with a NULL name */
    int nd, nq;                    /* 0: no map, constant inductances */
    const double *id_A, *iq_A, *psi_d_Vs, *psi_q_Vs;
} machine_data_t;

extern const machine_data_t machine_data;

#endif
