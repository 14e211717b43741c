/* SPDX-License-Identifier: Apache-2.0 */
#ifndef VECU_CAN_BUS_H
#define VECU_CAN_BUS_H
/** A classic CAN bus in simulated time: frames queue at their nodes, the lowest identifier among the heads of the
 * queues is transmitted next, and every frame occupies the bus for its length with the most stuff bits it can need:
 *   (VB-1)  bits = 47 + 8 n + floor((33 + 8 n)/4)    standard identifier, n data bytes, 3 bits between frames included
 *   (VB-2)  bits = 67 + 8 n + floor((53 + 8 n)/4)    extended
 * Source   ISO 11898-1; g + 8n bits are open to stuffing (g = 34 or 54), at most one stuff bit after each 4 of them
 * Units    ns of simulated time
 * Errors   a frame for which a node's queue is full is lost and counted. Bit errors and bus-off are not modelled
 * Context  simulation only; pure */
#include <stdbool.h>
#include <stdint.h>

#include "types/can_frame.h"

enum { CAN_BUS_NODES = 17, CAN_BUS_QUEUE = 1024, CAN_BUS_ECU = 0, CAN_BUS_MAILBOXES = 16 /* of the ECU */ };
#define CAN_BUS_WINDOW_NS 100000000ULL /* the load is counted in windows of 100 ms */
#define CAN_BUS_LOAD_MAX 0.7           /* above it frames of low priority wait long; such windows are counted */

typedef struct {
    can_frame_t frame;
    uint64_t arrival_ns;
} can_bus_entry_t;

typedef struct {
    can_bus_entry_t entry[CAN_BUS_QUEUE];
    uint32_t first, count;
} can_bus_node_t;

typedef struct {
    uint64_t frames, bits, lost;
    double load, load_peak;         /* in the last complete window; largest so far; 1 = the bus was never idle */
    double own_load_peak;           /* largest load by the frames of the ECU alone */
    uint64_t windows, windows_over; /* complete windows; those with more than CAN_BUS_LOAD_MAX */
} can_bus_counts_t;

typedef struct {
    uint32_t bit_rate;
    can_bus_node_t node[CAN_BUS_NODES];
    uint64_t free_ns; /* when the bus becomes idle */
    bool flying;
    int from;
    can_frame_t frame;
    uint64_t window, window_bits, window_own_bits;
    can_bus_counts_t counts;
} can_bus_t;

typedef struct {
    can_frame_t frame;
    int from;
    uint64_t end_ns; /* end of its last bit */
} can_bus_passed_t;

void can_bus_init(can_bus_t *bus, uint32_t bit_rate);
uint32_t can_bus_bits(const can_frame_t *frame);
/** Queues a frame at a node; false: its queue is full. */
bool can_bus_post(can_bus_t *bus, int node, const can_frame_t *frame, uint64_t now_ns);
/** The next frame whose transmission ends by `until`; false: none. */
bool can_bus_next(can_bus_t *bus, uint64_t until_ns, can_bus_passed_t *passed);
/** The ECU is switched off: its frame on the bus and its queued frames are lost. */
void can_bus_silence_ecu(can_bus_t *bus);

#endif
