/* SPDX-License-Identifier: Apache-2.0 */
#include <stdbool.h>
#include <stddef.h>

#include "hal/host/parameters.h"

/* Whether a value differs from that of the row before; before row 0 there is none (-1). */
static bool differs(const fluxtrue_batch_t *b, int row, int column)
{
    const double *value = &b->set_values[(size_t)row * (size_t)b->sets + (size_t)column];
    return row == 0 || *value != *(value - b->sets);
}

static int check_sets(const fluxtrue_t *drive, const fluxtrue_batch_t *b)
{
    for (int row = 0; row < b->periods; row++) {
        for (int k = 0; k < b->sets; k++) {
            const double value = b->set_values[(size_t)row * (size_t)b->sets + (size_t)k];
            const int code = parameters_check(drive, b->set[k], value);
            if (code != FLUXTRUE_OK) {
                return code;
            }
        }
    }
    return FLUXTRUE_OK;
}

static int check_batch(const fluxtrue_t *drive, const fluxtrue_batch_t *b)
{
    if (b->periods < 0 || b->sets < 0 || b->gets < 0) {
        return FLUXTRUE_OUT_OF_RANGE;
    }
    for (int k = 0; k < b->gets; k++) {
        if (!fluxtrue_name(b->get[k])) {
            return FLUXTRUE_UNKNOWN_NAME;
        }
    }
    return check_sets(drive, b);
}

static void set_row(fluxtrue_t *drive, const fluxtrue_batch_t *b, int row)
{
    for (int k = 0; k < b->sets; k++) {
        if (differs(b, row, k)) {
            (void)fluxtrue_set_by(drive, b->set[k], b->set_values[(size_t)row * (size_t)b->sets + (size_t)k]);
        }
    }
}

int fluxtrue_run(fluxtrue_t *drive, const fluxtrue_batch_t *batch)
{
    const int code = check_batch(drive, batch);
    for (int row = 0; code == FLUXTRUE_OK && row < batch->periods; row++) {
        double out[4];
        set_row(drive, batch, row);
        fluxtrue_step(drive, &batch->in[6 * (size_t)row], batch->out ? &batch->out[4 * (size_t)row] : out);
        for (int k = 0; k < batch->gets; k++) {
            batch->get_values[(size_t)row * (size_t)batch->gets + (size_t)k] = fluxtrue_get_by(drive, batch->get[k]);
        }
    }
    return code;
}
