/* SPDX-License-Identifier: Apache-2.0 */
#include "calibration/measurements.h"

#include "drive/drive_si.h"
#include "drive/mrai/mrai_seam.h"
#include "hal/temperature.h"

#define MEASURED(drive) ((drive)->samples.slot[(drive)->samples.generation % SAMPLE_SLOTS])

#define WRITE(name, type, base, expression, text) measurements->name = (MEASUREMENT_TYPE_##type)(expression);

void measurements_step(measurements_t *measurements, const drive_t *d, bool recorded)
{
    MEASUREMENT_KEPT_LIST(WRITE)
    if (recorded) {
        MEASUREMENT_RECORDED_LIST(WRITE)
    }
}
