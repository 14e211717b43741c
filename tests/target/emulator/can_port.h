/* SPDX-License-Identifier: Apache-2.0 */
#ifndef EMULATOR_CAN_PORT_H
#define EMULATOR_CAN_PORT_H
/** Connects the emulated CAN controller to a bus: frames that it sends, and frames that it receives.
 * Source   docs/howto/emulate.md
 * Context  sent() is called while the emulation runs; can_frame_arrives() between two runs */
#include <stdbool.h>
#include <stdint.h>

#include "emu.h"

#define EMU_CAN_FIFO 6

typedef struct {
    uint32_t id;
    bool extended;
    uint8_t length;
    uint8_t data[8];
} can_port_frame_t;

typedef struct can_port {
    void (*sent)(void *user, const can_port_frame_t *frame, uint64_t now);
    void *user;
} can_port_t;

EMU_API void emu_can_port(emu_t *emu, can_port_t *port);
EMU_API void can_frame_arrives(emu_t *emu, const can_port_frame_t *frame);

#endif
