/* SPDX-License-Identifier: Apache-2.0 */
#ifndef VECU_LINE_SERVER_H
#define VECU_LINE_SERVER_H
/** A TCP port on 127.0.0.1 whose clients send and receive short texts: lines, or texts between '<' and '>'.
 * Source   docs/howto/bench.md
 * Range    LINE_CLIENTS clients, texts of up to LINE_LENGTH characters without NUL
 * Errors   input that is not a text (too long, with a NUL, cut off by the end of the connection) is dropped and
 *          counted; a client that does not read its output is disconnected and counted; no input can stop the server
 * Context  simulation only; one thread; only line_server_wait() blocks */
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "line_buffer.h"

enum { LINE_CLIENTS = 16 };

typedef struct line_server line_server_t;

typedef enum {
    LINE_NONE,   /* no event */
    LINE_OPENED, /* a client has connected */
    LINE_TEXT,   /* a text has arrived */
    LINE_CLOSED  /* a client has disconnected; its number may be used for another one */
} line_event_t;

typedef struct {
    uint64_t connects, texts, dropped, slow_clients, refused;
} line_counts_t;

/** Listens; port 0: any free one. NULL: `why` has the reason, with the port in it. */
line_server_t *line_server_create(uint16_t port, line_framing_t framing, char *why, size_t size);
void line_server_destroy(line_server_t *server);
uint16_t line_server_port(const line_server_t *server);
line_counts_t line_server_counts(const line_server_t *server);

/** Waits until a client of one of the servers has sent input or can take output, at most timeout_ms (negative: without
 * limit); then reads all input and writes as much output as possible. */
void line_server_wait(line_server_t *const *servers, int count, int timeout_ms);

/** The next event; a text without its delimiters, NUL-terminated. */
line_event_t line_server_next(line_server_t *server, int *client, char text[LINE_LENGTH + 1]);

/** Queues a text, which includes its delimiters. */
void line_server_send(line_server_t *server, int client, const char *text, size_t length);

/** Number of bytes that wait for the slowest client. */
size_t line_server_backlog(const line_server_t *server);
/** Disconnects the clients with more than `bytes` waiting. */
void line_server_drop_slow(line_server_t *server, size_t bytes);
/** The port on the client's side, by which a client can name its own connection; 0: no such client. */
uint16_t line_server_peer(const line_server_t *server, int client);
/** False: the client has ended. */
bool line_server_connected(const line_server_t *server, int client);

#endif
