/* SPDX-License-Identifier: Apache-2.0 */
#include "can_bus.h"

#include <string.h>

#define NS_PER_S 1000000000ULL

void can_bus_init(can_bus_t *bus, uint32_t bit_rate)
{
    memset(bus, 0, sizeof *bus);
    bus->bit_rate = bit_rate;
}

uint32_t can_bus_bits(const can_frame_t *frame)
{
    const uint32_t data = 8U * frame->length;
    return frame->extended ? 67U + data + (53U + data) / 4U : 47U + data + (33U + data) / 4U;
}

/* Arbitration of the bus: bit by bit, dominant (0) wins; with the same first 11 bits the standard frame wins. */
static uint32_t rank(const can_frame_t *frame)
{
    if (!frame->extended) {
        return frame->id << 19;
    }
    return ((frame->id >> 18) << 19) | (1U << 18) | (frame->id & 0x3FFFFU);
}

bool can_bus_post(can_bus_t *bus, int node, const can_frame_t *frame, uint64_t now_ns)
{
    can_bus_node_t *n = &bus->node[node];
    if (n->count == (node == CAN_BUS_ECU ? (uint32_t)CAN_BUS_MAILBOXES : (uint32_t)CAN_BUS_QUEUE)) {
        bus->counts.lost++;
        return false;
    }
    n->entry[(n->first + n->count) % CAN_BUS_QUEUE] = (can_bus_entry_t){*frame, now_ns};
    n->count++;
    return true;
}

static void window_close(can_bus_t *bus)
{
    const double max = (double)bus->bit_rate * (double)CAN_BUS_WINDOW_NS / (double)NS_PER_S;
    can_bus_counts_t *c = &bus->counts;
    const double own = (double)bus->window_own_bits / max;
    c->load = (double)bus->window_bits / max;
    c->load_peak = c->load > c->load_peak ? c->load : c->load_peak;
    c->own_load_peak = own > c->own_load_peak ? own : c->own_load_peak;
    c->windows++;
    c->windows_over += c->load > CAN_BUS_LOAD_MAX ? 1U : 0U;
    bus->window_bits = bus->window_own_bits = 0;
    bus->window++;
}

static void account(can_bus_t *bus, uint64_t until_ns, uint32_t bits)
{
    const uint64_t window = until_ns / CAN_BUS_WINDOW_NS;
    while (bus->window < window) {
        window_close(bus);
    }
    bus->window_bits += bits;
    bus->window_own_bits += bus->from == CAN_BUS_ECU ? bits : 0U;
    bus->counts.bits += bits;
    bus->counts.frames += bits > 0U ? 1U : 0U;
}

/* The node that transmits next, and when it begins; the bus is idle from free_ns on. -1: none before `until`. */
static int arbitrate(const can_bus_t *bus, uint64_t until_ns, uint64_t *start_ns)
{
    uint64_t first_ns = until_ns;
    int winner = -1;
    for (int i = 0; i < CAN_BUS_NODES; i++) {
        const can_bus_node_t *n = &bus->node[i];
        if (n->count > 0U && n->entry[n->first].arrival_ns < first_ns) {
            first_ns = n->entry[n->first].arrival_ns;
        }
    }
    *start_ns = first_ns > bus->free_ns ? first_ns : bus->free_ns;
    for (int i = 0; i < CAN_BUS_NODES && *start_ns < until_ns; i++) {
        const can_bus_node_t *n = &bus->node[i];
        if (n->count > 0U && n->entry[n->first].arrival_ns <= *start_ns &&
            (winner < 0 ||
             rank(&n->entry[n->first].frame) < rank(&bus->node[winner].entry[bus->node[winner].first].frame))) {
            winner = i;
        }
    }
    return winner;
}

static bool begin(can_bus_t *bus, uint64_t until_ns)
{
    uint64_t start_ns;
    const int winner = arbitrate(bus, until_ns, &start_ns);
    if (winner < 0) {
        return false;
    }
    can_bus_node_t *n = &bus->node[winner];
    bus->frame = n->entry[n->first].frame;
    bus->from = winner;
    bus->flying = true;
    bus->free_ns = start_ns + can_bus_bits(&bus->frame) * NS_PER_S / bus->bit_rate;
    n->first = (n->first + 1U) % CAN_BUS_QUEUE;
    n->count--;
    return true;
}

bool can_bus_next(can_bus_t *bus, uint64_t until_ns, can_bus_passed_t *passed)
{
    if ((!bus->flying && !begin(bus, until_ns)) || bus->free_ns > until_ns) {
        account(bus, until_ns, 0);
        return false;
    }
    bus->flying = false;
    account(bus, bus->free_ns, can_bus_bits(&bus->frame));
    *passed = (can_bus_passed_t){bus->frame, bus->from, bus->free_ns};
    return true;
}

void can_bus_silence_ecu(can_bus_t *bus)
{
    bus->node[CAN_BUS_ECU].count = 0;
    bus->flying = bus->flying && bus->from != CAN_BUS_ECU;
}
