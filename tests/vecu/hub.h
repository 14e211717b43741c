/* SPDX-License-Identifier: Apache-2.0 */
#ifndef VECU_HUB_H
#define VECU_HUB_H
/** One simulated CAN bus with an ECU on it, offered to any number of socketcand clients on 127.0.0.1.
 *   each step of simulated time: hub_poll(); hub_run(now); the ECU calls hub_receive() and hub_send()
 * Source   docs/howto/bench.md; tests/vecu/can_bus.h for the bus
 * Units    ns of simulated time, which must not go back; frames are stamped with the end of their last bit
 * Errors   hub_create() answers NULL and the reason; hub_send() false: the ECU's queue is full and the frame was not
 *          taken. Texts that are not of the protocol are dropped and counted
 * Context  simulation only; one thread; knows neither firmware nor plant */
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "can_bus.h"
#include "line_server.h"
#include "types/can_frame.h"

typedef struct hub hub_t;

typedef struct {
    uint64_t malformed; /* texts of clients that are not of the protocol */
    uint64_t from_clients, to_ecu, from_ecu;
    uint64_t ecu_lost; /* frames lost because the ECU's receive queue was full */
    can_bus_counts_t bus;
    line_counts_t lines;
} hub_counts_t;

hub_t *hub_create(uint16_t port, uint32_t bit_rate, char *why, size_t size);
void hub_destroy(hub_t *hub);

/** The server behind the port, for a caller that waits for several at once (line_server_wait). */
line_server_t *hub_server(hub_t *hub);
/** Processes the clients' input; call it after waiting. */
void hub_service(hub_t *hub, uint64_t now_ns);
/** Waits at most timeout_ms for the clients, then hub_service(). */
void hub_poll(hub_t *hub, uint64_t now_ns, int timeout_ms);
/** Advances the bus until now: transmitted frames are delivered to all nodes but their sender. */
void hub_run(hub_t *hub, uint64_t now_ns);

/** Whether hub_send() would take a frame. */
bool hub_can_queue(const hub_t *hub);
bool hub_send(hub_t *hub, const can_frame_t *frame, uint64_t now_ns);
bool hub_receive(hub_t *hub, can_frame_t *frame);

/** The ECU is switched off: its frames and its received frames are discarded. */
void hub_detach_ecu(hub_t *hub);

/** For the client whose side of the connection has this port: the number of frames that it sent, valid or not, and of
 * frames sent to it. False: no such client. To this client frames are sent at once from now on, because a client that
 * knows its own port has read the greetings. */
bool hub_client_counts(hub_t *hub, uint16_t peer, uint64_t *received, uint64_t *sent);
hub_counts_t hub_counts(const hub_t *hub);

#endif
