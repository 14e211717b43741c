/* SPDX-License-Identifier: Apache-2.0 */
#ifndef VECU_LINE_SERVER_H
#define VECU_LINE_SERVER_H
/** A TCP port on 127.0.0.1 whose clients speak in short texts: lines, or words between '<' and '>'.
 * Source   docs/howto/bench.md
 * Range    LINE_CLIENTS clients, texts of up to LINE_LENGTH characters without NUL
 * Errors   input that is not a text (too long, with a NUL, cut off by the end of the connection) is dropped and
 *          counted; a client that does not read its output is disconnected and counted; no input can stop the server
 * Context  simulation only; one thread; nothing blocks but line_server_wait() */
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "line_buffer.h"

enum { LINE_CLIENTS = 16 };

typedef struct line_server line_server_t;

typedef enum {
    LINE_NONE,   /* nothing waits */
    LINE_OPENED, /* a client has connected */
    LINE_TEXT,   /* a text has arrived */
    LINE_CLOSED  /* a client has gone; its number will be given to another one */
} line_event_t;

typedef struct {
    uint64_t connects, texts, dropped, slow_clients, refused;
} line_counts_t;

/** Listens; port 0: any free one. NULL: the reason, with the port in it, is in `why`. */
line_server_t *line_server_create(uint16_t port, line_framing_t framing, char *why, size_t size);
void line_server_destroy(line_server_t *server);
uint16_t line_server_port(const line_server_t *server);
line_counts_t line_server_counts(const line_server_t *server);

/** Waits until a client of one of the servers has something for us or can take something from us, at most timeout_ms
 * (negative: for ever), then reads and writes what there is. */
void line_server_wait(line_server_t *const *servers, int count, int timeout_ms);

/** The next event; a text without its delimiters, NUL-terminated. */
line_event_t line_server_next(line_server_t *server, int *client, char text[LINE_LENGTH + 1]);

/** Queues a text as it is, frame and all. */
void line_server_send(line_server_t *server, int client, const char *text, size_t length);

/** Bytes that wait for the slowest client. */
size_t line_server_backlog(const line_server_t *server);
/** Disconnects the clients with more than `bytes` waiting. */
void line_server_drop_slow(line_server_t *server, size_t bytes);
/** The port on the client's side, 0 if there is no such client: how a client names its own connection. */
uint16_t line_server_peer(const line_server_t *server, int client);
/** False: the client has ended. */
bool line_server_connected(const line_server_t *server, int client);

#endif
