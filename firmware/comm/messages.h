/* SPDX-License-Identifier: Apache-2.0 */
#ifndef COMM_MESSAGES_H
#define COMM_MESSAGES_H
/** The values that the drive transmits on the bus, in physical units, and their encoding.
 *   Every value is clamped to the DBC's range of its signal; for one that is NaN or infinity no frame is sent.
 * Source   firmware/comm/fluxtrue.dbc; docs/decisions/018-bus-scales.md
 * Units    SI or as the names say; signs as in the DBC
 * Range    every float: clamped to the range of its signal
 * Rounding to nearest in the motor's scale
 * Errors   encoders answer false for a value that is not finite: the frame must not be sent
 * Context  1 kHz task */
#include <stdbool.h>
#include <stdint.h>

#include "types/bus_scales.h"

#define MESSAGE_LENGTH 8U
#define INTERFACE_VERSION 3U /* VERSION of the DBC: counted up when a signal changes its name, meaning or place */

/* Why the torque is limited, as transmitted; X(NAME, value, explanation): named and explained here only. */
#define DERATING_REASON_LIST(X) \
    X(NONE, 0, "The torque is not limited.") \
    X(INVERTER_TEMPERATURE, 1, "The inverter is too warm.") \
    X(WINDING_TEMPERATURE, 2, "The winding is too warm.") \
    X(DC_VOLTAGE, 3, "The dc voltage is near a limit.") \
    X(BATTERY_POWER, 4, "The battery's power limit is reached.") \
    X(MAGNET, 5, "i_d is at the limit that protects the magnets.") \
    X(TEMPERATURE_SENSOR, 6, "A temperature sensor is out of its range.") \
    X(BATTERY_LIMITS_LOST, 7, "The battery's limits were received once and are lost.") \
    X(SPEED, 8, "The speed is near its limit.")

/* The limit that the requested torque exceeds; X(NAME, value, explanation): named and explained here only. */
#define REQUEST_LIMIT_LIST(X) \
    X(NONE, 0, "The requested torque is within every limit.") \
    X(RATED_TORQUE, 1, "The requested torque is beyond the rated torque of the machine.") \
    X(VEHICLE_LIMIT, 2, "The requested torque is beyond the limit in the same command.") \
    X(REACH, 3, "The requested torque is beyond TorqueMax, which voltage and current allow now.")

#define REQUEST_LIMIT_VALUE(name, value, text) REQUEST_LIMIT_##name = (value),
typedef enum { REQUEST_LIMIT_LIST(REQUEST_LIMIT_VALUE) } request_limit_t;
#undef REQUEST_LIMIT_VALUE

#define DERATING_REASON_VALUE(name, value, text) DERATING_REASON_##name = (value),
typedef enum { DERATING_REASON_LIST(DERATING_REASON_VALUE) } derating_reason_t;
#undef DERATING_REASON_VALUE

typedef struct {
    uint32_t crc_errors, repeated, jumps, length_errors, range_errors, id_errors, time_outs, accepted, skipped;
    uint32_t lost_frames, not_sent, ignored, bus_off;
    uint32_t isr_overruns, task_overruns, stack_unused_bytes, reset_cause, watchdog_held;
} diagnostics_t;

typedef struct {
    const bus_scales_t *scales;
    uint32_t state;
    float torque_estimated_Nm, torque_commanded_Nm, torque_max_Nm, speed_rpm;
    float v_dc_V, i_dc_A;
    uint32_t derating_reason, refused_reason, refused_count, request_limit;
    float id_A, iq_A, id_ref_A, iq_ref_A;
    float psi_f_mVs, r_mohm, psi_quality_percent, r_quality_percent, table_scale_percent;
    bool psi_clamped, r_clamped;
    float winding_C, inverter_C;
    bool winding_valid, inverter_valid;
    uint32_t drive_faults, ecu_faults, first_fault, fault_count;
    uint32_t motor_check;   /* motor_check_t */
    const char *motor_name; /* transmitted as its hash */
    uint32_t interface_hash;
    diagnostics_t diagnostics;
} telemetry_t;

typedef bool (*message_encoder_t)(const telemetry_t *telemetry, uint8_t *data);

bool message_inv_status(const telemetry_t *telemetry, uint8_t *data);
bool message_inv_dc_link(const telemetry_t *telemetry, uint8_t *data);
bool message_inv_currents(const telemetry_t *telemetry, uint8_t *data);
bool message_inv_identification(const telemetry_t *telemetry, uint8_t *data);
bool message_inv_temperatures(const telemetry_t *telemetry, uint8_t *data);
bool message_inv_limits(const telemetry_t *telemetry, uint8_t *data);
bool message_inv_faults(const telemetry_t *telemetry, uint8_t *data);
bool message_inv_configuration(const telemetry_t *telemetry, uint8_t *data);
bool message_inv_diag_protection(const telemetry_t *telemetry, uint8_t *data);
bool message_inv_diag_receive(const telemetry_t *telemetry, uint8_t *data);
bool message_inv_diag_bus(const telemetry_t *telemetry, uint8_t *data);
bool message_inv_diag_task(const telemetry_t *telemetry, uint8_t *data);
bool message_inv_version(const telemetry_t *telemetry, uint8_t *data);

#endif
