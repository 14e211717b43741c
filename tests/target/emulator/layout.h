/* SPDX-License-Identifier: Apache-2.0 */
#ifndef EMULATOR_LAYOUT_H
#define EMULATOR_LAYOUT_H
/** Parts of drive_t with the same layout on target and host (no pointers inside, short enumerations), for copying
 * between the image's memory and a drive_t on the host. Compiled twice: for the target, to obtain its offsets.
 * Source   drive/drive.h
 * Context  emulator only */

/* The request and the calibration, with their complements. The image writes to some of them as well: to the request and
 * to the dead time that its task trims. */
#define LAYOUT_INPUTS(X) \
    X(request)                \
    X(parameters.modulate)    \
    X(data_check.parameters)       \
    X(data_check.options)          \
    X(parameters.torque_slew) \
    X(mrai_parameters)        \
    X(data_check.mrai_parameters) \
    X(parameters.torque_loop)

/* The state that the activities write. */
#define LAYOUT_STATE(X) \
    X(fast)             \
    X(psi_d_error)      \
    X(task)             \
    X(samples)          \
    X(windows)          \
    X(commands)         \
    X(mrai)

#define LAYOUT_SYMBOL "ecu" /* its first member is the drive */

#endif
