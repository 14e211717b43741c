/* SPDX-License-Identifier: Apache-2.0 */
#define _POSIX_C_SOURCE 200809L
#include "line_client.h"

#include <errno.h>
#include <poll.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>
#include <unistd.h>

void line_client_close(line_client_t *c)
{
    if (c->fd >= 0) {
        (void)close(c->fd);
    }
    free(c->out);
    memset(c, 0, sizeof *c);
    c->fd = -1;
}

void line_client_read(line_client_t *c)
{
    for (size_t free_bytes = line_buffer_free(&c->in); free_bytes > 0U; free_bytes = line_buffer_free(&c->in)) {
        const ssize_t got = recv(c->fd, c->in.bytes + c->in.end, free_bytes, 0);
        if (got > 0) {
            c->in.end += (size_t)got;
        } else if (got == 0 || (errno != EINTR && errno != EAGAIN && errno != EWOULDBLOCK)) {
            c->ended = true;
            return;
        } else if (errno != EINTR) {
            return;
        }
    }
}

void line_client_write(line_client_t *c)
{
    while (c->out_begin < c->out_end) {
        const ssize_t put = send(c->fd, c->out + c->out_begin, c->out_end - c->out_begin, MSG_NOSIGNAL);
        if (put >= 0) {
            c->out_begin += (size_t)put;
        } else if (errno == EAGAIN || errno == EWOULDBLOCK) {
            return;
        } else if (errno != EINTR) {
            c->ended = true;
            break; /* the client does not read the rest */
        }
    }
    c->out_begin = c->out_end = 0;
}

short line_client_wants(const line_client_t *c)
{
    const bool has_space = !c->ended && c->in.end - c->in.begin < LINE_BUFFER_SIZE;
    return (short)((has_space ? POLLIN : 0) | (c->out_end > c->out_begin ? POLLOUT : 0));
}

static bool reserve_output(line_client_t *c, size_t length)
{
    if (c->out_end + length <= c->out_size) {
        return true;
    }
    const size_t size = 2U * (c->out_end + length);
    char *out = realloc(c->out, size);
    if (out == NULL) {
        return false;
    }
    c->out = out;
    c->out_size = size;
    return true;
}

void line_client_send(line_client_t *c, const char *text, size_t length)
{
    if (c->fd < 0) {
        return;
    }
    if (c->out_begin > 0U) {
        memmove(c->out, c->out + c->out_begin, c->out_end - c->out_begin);
        c->out_end -= c->out_begin;
        c->out_begin = 0;
    }
    if (!reserve_output(c, length)) {
        c->ended = true;
        return;
    }
    memcpy(c->out + c->out_end, text, length);
    c->out_end += length;
}
