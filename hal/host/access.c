/* SPDX-License-Identifier: Apache-2.0 */
#include <float.h>
#include <math.h>
#include <stddef.h>
#include <string.h>

#include "calibration/calibration.h"
#include "drive/data_check.h"
#include "hal/host/instance.h"
#include "hal/host/parameters.h"
#include "hal/host/stations.h"

/* Torque and current requests are bounded by what the motor data allow, which are floats. */
static double bound_of(const fluxtrue_t *drive, const parameter_t *p)
{
    const motor_t *m = drive->drive.motor;
    if (p->set == stations_set_requested_Nm) {
        return (double)m->torque_max_Nm;
    }
    return (double)((float)m->current_reference.i_max / 32768.0f * m->bases.current_A);
}

/* Not isinf(): MinGW's macro converts its argument to a float. */
static bool is_number(double bound)
{
    return fabs(bound) <= DBL_MAX;
}

static bool is_parameter(int handle)
{
    return handle >= 0 && handle < parameters_count;
}

static bool is_calibration(int handle)
{
    return handle >= parameters_count && handle < parameters_count + CALIBRATION_COUNT;
}

static calibration_id_t calibration_of(int handle)
{
    return (calibration_id_t)(handle - parameters_count);
}

const char *fluxtrue_name(int index)
{
    if (is_parameter(index)) {
        return parameters[index].name;
    }
    return is_calibration(index) ? calibration_info[calibration_of(index)].name : NULL;
}

int fluxtrue_handle(const char *name)
{
    const char *present = stations_name(name);
    for (int k = 0; present && k < parameters_count + CALIBRATION_COUNT; k++) {
        if (strcmp(present, fluxtrue_name(k)) == 0) {
            return k;
        }
    }
    return FLUXTRUE_UNKNOWN_NAME;
}

bool parameters_writable(int handle)
{
    return is_calibration(handle) || (is_parameter(handle) && parameters[handle].set != NULL);
}

parameters_range_t parameters_range(const fluxtrue_t *drive, int handle)
{
    if (is_calibration(handle)) {
        const value_range_t range = calibration_range(&drive->drive, calibration_of(handle));
        return (parameters_range_t){(double)range.lo, (double)range.hi, (double)range.least};
    }
    const parameter_t *p = &parameters[handle];
    const double hi = is_number(p->hi) ? p->hi : bound_of(drive, p);
    return (parameters_range_t){is_number(p->lo) ? p->lo : -hi, hi, 0.0};
}

int parameters_check(const fluxtrue_t *drive, int handle, double value)
{
    if (!is_parameter(handle) && !is_calibration(handle)) {
        return FLUXTRUE_UNKNOWN_NAME;
    }
    if (!parameters_writable(handle)) {
        return FLUXTRUE_READ_ONLY;
    }
    /* A value whose bound is a float is compared as a float: 1.8 as a double exceeds 1.8f. */
    const bool of_floats = is_calibration(handle) || !is_number(parameters[handle].hi);
    const double compared = of_floats ? (double)(float)value : value;
    const parameters_range_t range = parameters_range(drive, handle);
    const bool meant = !is_calibration(handle) || value == 0.0 || compared >= range.least;
    return (compared >= range.lo && compared <= range.hi && meant) ? FLUXTRUE_OK : FLUXTRUE_OUT_OF_RANGE;
}

int fluxtrue_set_by(fluxtrue_t *drive, int handle, double value)
{
    const int code = parameters_check(drive, handle, value);
    if (code == FLUXTRUE_OK && is_calibration(handle)) {
        calibration_set(&drive->drive, calibration_of(handle), (float)value);
    } else if (code == FLUXTRUE_OK) {
        parameters[handle].set(drive, value);
        data_check_accept_options(&drive->drive);
    }
    return code;
}

double fluxtrue_get_by(const fluxtrue_t *drive, int handle)
{
    if (is_parameter(handle)) {
        return parameters[handle].get(drive);
    }
    return is_calibration(handle) ? (double)calibration_get(&drive->drive, calibration_of(handle)) : (double)NAN;
}

int fluxtrue_set(fluxtrue_t *drive, const char *name, double value)
{
    return fluxtrue_set_by(drive, fluxtrue_handle(name), value);
}

double fluxtrue_get(const fluxtrue_t *drive, const char *name)
{
    return fluxtrue_get_by(drive, fluxtrue_handle(name));
}
