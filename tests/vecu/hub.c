/* SPDX-License-Identifier: Apache-2.0 */
#define _POSIX_C_SOURCE 200809L
#include "hub.h"

#include <stdlib.h>
#include <string.h>
#include <time.h>

#include "socketcand.h"

/* python-can's client expects "< ok >" alone in one read and fails if a frame follows in the same read. Frames are sent
 * to a client only after this time on the wall clock, or once it has sent a text itself. */
#define GREETING_MS 100
enum { ECU_QUEUE = 64 };

typedef enum { SESSION_NONE, SESSION_GREETED, SESSION_OPEN, SESSION_RAW } session_state_t;

typedef struct {
    session_state_t state;
    bool ready;
    int64_t raw_since_ms;
    uint64_t received, sent;
} session_t;

struct hub {
    line_server_t *server;
    can_bus_t bus;
    session_t session[LINE_CLIENTS];
    can_frame_t to_ecu[ECU_QUEUE];
    uint32_t first, count;
    hub_counts_t counts;
};

hub_t *hub_create(uint16_t port, uint32_t bit_rate, char *why, size_t size)
{
    hub_t *hub = calloc(1, sizeof *hub);
    line_server_t *server = line_server_create(port, LINE_IN_BRACKETS, why, size);
    if (hub == NULL || server == NULL) {
        line_server_destroy(server);
        free(hub);
        return NULL;
    }
    hub->server = server;
    can_bus_init(&hub->bus, bit_rate);
    return hub;
}

void hub_destroy(hub_t *hub)
{
    if (hub != NULL) {
        line_server_destroy(hub->server);
        free(hub);
    }
}

line_server_t *hub_server(hub_t *hub)
{
    return hub->server;
}

static int64_t wall_ms(void)
{
    struct timespec now;
    (void)clock_gettime(CLOCK_MONOTONIC, &now);
    return (int64_t)now.tv_sec * 1000 + now.tv_nsec / 1000000;
}

static int node_of(int client)
{
    return client + 1; /* node 0 is the ECU */
}

static void answer(hub_t *hub, int client, const char *text)
{
    line_server_send(hub->server, client, text, strlen(text));
}

static void talk(hub_t *hub, int client, const char *text, uint64_t now_ns)
{
    session_t *s = &hub->session[client];
    can_frame_t frame;
    const socketcand_t said = socketcand_parse(text, &frame);
    if (said == SOCKETCAND_OPEN && s->state == SESSION_GREETED) {
        s->state = SESSION_OPEN;
        answer(hub, client, "< ok >");
    } else if (said == SOCKETCAND_RAW && s->state == SESSION_OPEN) {
        s->state = SESSION_RAW;
        s->raw_since_ms = wall_ms();
        answer(hub, client, "< ok >");
    } else if (said == SOCKETCAND_SEND && s->state == SESSION_RAW) {
        s->ready = true;
        s->received++;
        hub->counts.from_clients++;
        (void)can_bus_post(&hub->bus, node_of(client), &frame, now_ns);
    } else {
        s->received++; /* a client that counts what it has sent counts this, too */
        hub->counts.malformed++;
    }
}

void hub_service(hub_t *hub, uint64_t now_ns)
{
    char text[LINE_LENGTH + 1];
    int client;
    line_event_t event;
    while ((event = line_server_next(hub->server, &client, text)) != LINE_NONE) {
        if (event == LINE_OPENED) {
            hub->session[client] = (session_t){.state = SESSION_GREETED};
            answer(hub, client, "< hi >");
        } else if (event == LINE_CLOSED) {
            hub->session[client] = (session_t){.state = SESSION_NONE};
        } else {
            talk(hub, client, text, now_ns);
        }
    }
}

void hub_poll(hub_t *hub, uint64_t now_ns, int timeout_ms)
{
    line_server_wait(&hub->server, 1, timeout_ms);
    hub_service(hub, now_ns);
}

static void give_to_ecu(hub_t *hub, const can_frame_t *frame)
{
    if (hub->count == ECU_QUEUE) {
        hub->counts.ecu_lost++;
        return;
    }
    hub->to_ecu[(hub->first + hub->count) % ECU_QUEUE] = *frame;
    hub->count++;
    hub->counts.to_ecu++;
}

static void give_to_clients(hub_t *hub, const can_bus_passed_t *passed)
{
    char text[SOCKETCAND_TEXT];
    const size_t length = socketcand_format(text, &passed->frame, passed->end_ns);
    for (int i = 0; i < LINE_CLIENTS; i++) {
        session_t *s = &hub->session[i];
        if (s->state != SESSION_RAW || node_of(i) == passed->from) {
            continue;
        }
        s->ready = s->ready || wall_ms() - s->raw_since_ms > GREETING_MS;
        if (s->ready) {
            s->sent++;
            line_server_send(hub->server, i, text, length);
        }
    }
}

void hub_run(hub_t *hub, uint64_t now_ns)
{
    can_bus_passed_t passed;
    while (can_bus_next(&hub->bus, now_ns, &passed)) {
        if (passed.from != CAN_BUS_ECU) {
            give_to_ecu(hub, &passed.frame);
        }
        give_to_clients(hub, &passed);
    }
}

bool hub_can_queue(const hub_t *hub)
{
    return hub->bus.node[CAN_BUS_ECU].count < (uint32_t)CAN_BUS_MAILBOXES;
}

bool hub_send(hub_t *hub, const can_frame_t *frame, uint64_t now_ns)
{
    const bool taken = can_bus_post(&hub->bus, CAN_BUS_ECU, frame, now_ns);
    hub->counts.from_ecu += taken ? 1U : 0U;
    return taken;
}

bool hub_receive(hub_t *hub, can_frame_t *frame)
{
    if (hub->count == 0U) {
        return false;
    }
    *frame = hub->to_ecu[hub->first];
    hub->first = (hub->first + 1U) % ECU_QUEUE;
    hub->count--;
    return true;
}

void hub_detach_ecu(hub_t *hub)
{
    can_bus_silence_ecu(&hub->bus);
    hub->count = 0;
}

bool hub_client_counts(hub_t *hub, uint16_t peer, uint64_t *received, uint64_t *sent)
{
    for (int i = 0; i < LINE_CLIENTS; i++) {
        session_t *s = &hub->session[i];
        if (s->state != SESSION_NONE && line_server_peer(hub->server, i) == peer) {
            s->ready = s->ready || s->state == SESSION_RAW;
            *received = s->received;
            *sent = s->sent;
            return true;
        }
    }
    return false;
}

hub_counts_t hub_counts(const hub_t *hub)
{
    hub_counts_t counts = hub->counts;
    counts.bus = hub->bus.counts;
    counts.lines = line_server_counts(hub->server);
    return counts;
}
