/* SPDX-License-Identifier: Apache-2.0 */
#ifndef VECU_LINE_CLIENT_H
#define VECU_LINE_CLIENT_H
/** One connection of a line server: the input received and the output still to be sent. No function blocks.
 * Errors   a connection that breaks, or whose output finds no memory, is marked as ended
 * Context  tests/vecu/line_server.c only */
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "line_buffer.h"

typedef struct {
    int fd;              /* -1: free */
    bool greeted, ended; /* ended: no more input; received texts are still answered */
    uint16_t peer;
    line_buffer_t in;
    char *out;
    size_t out_begin, out_end, out_size;
} line_client_t;

void line_client_close(line_client_t *c);
void line_client_read(line_client_t *c);
void line_client_write(line_client_t *c);
/** The events to give to poll(). */
short line_client_wants(const line_client_t *c);
void line_client_send(line_client_t *c, const char *text, size_t length);

#endif
