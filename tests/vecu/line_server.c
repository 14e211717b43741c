/* SPDX-License-Identifier: Apache-2.0 */
#define _POSIX_C_SOURCE 200809L
#include "line_server.h"

#include <arpa/inet.h>
#include <errno.h>
#include <fcntl.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <poll.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>
#include <unistd.h>

#include "line_client.h"

enum { SERVERS_MAX = 4 };

struct line_server {
    int listener;
    uint16_t port;
    line_framing_t framing;
    line_counts_t counts;
    line_client_t client[LINE_CLIENTS];
    int next_client; /* the client whose text is taken next: clients take turns */
};

static bool set_nonblocking(int fd)
{
    const int flags = fcntl(fd, F_GETFL);
    return flags >= 0 && fcntl(fd, F_SETFL, flags | O_NONBLOCK) >= 0;
}

static int listen_on(uint16_t *port)
{
    const int fd = socket(AF_INET, SOCK_STREAM, 0);
    const int on = 1;
    struct sockaddr_in at = {.sin_family = AF_INET, .sin_port = htons(*port)};
    socklen_t size = sizeof at;
    at.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    if (fd < 0) {
        return -1;
    }
    (void)setsockopt(fd, SOL_SOCKET, SO_REUSEADDR, &on, sizeof on);
    if (bind(fd, (struct sockaddr *)&at, sizeof at) < 0 || listen(fd, LINE_CLIENTS) < 0 ||
        getsockname(fd, (struct sockaddr *)&at, &size) < 0 || !set_nonblocking(fd)) {
        const int error = errno;
        (void)close(fd);
        errno = error;
        return -1;
    }
    *port = ntohs(at.sin_port);
    return fd;
}

line_server_t *line_server_create(uint16_t port, line_framing_t framing, char *why, size_t size)
{
    line_server_t *server = calloc(1, sizeof *server);
    if (server == NULL) {
        (void)snprintf(why, size, "out of memory");
        return NULL;
    }
    server->port = port;
    server->framing = framing;
    for (int i = 0; i < LINE_CLIENTS; i++) {
        server->client[i].fd = -1;
    }
    server->listener = listen_on(&server->port);
    if (server->listener < 0) {
        (void)snprintf(why, size, "port %u on 127.0.0.1: %s", (unsigned)port, strerror(errno));
        free(server);
        return NULL;
    }
    return server;
}

void line_server_destroy(line_server_t *server)
{
    if (server == NULL) {
        return;
    }
    for (int i = 0; i < LINE_CLIENTS; i++) {
        line_client_close(&server->client[i]);
    }
    (void)close(server->listener);
    free(server);
}

uint16_t line_server_port(const line_server_t *server)
{
    return server->port;
}

line_counts_t line_server_counts(const line_server_t *server)
{
    line_counts_t counts = server->counts;
    for (int i = 0; i < LINE_CLIENTS; i++) {
        counts.dropped += server->client[i].in.dropped;
    }
    return counts;
}

static void client_accept(line_server_t *server)
{
    struct sockaddr_in from;
    socklen_t size = sizeof from;
    const int on = 1;
    const int send_size = 1 << 17; /* the rest waits in line_client, where it is counted */
    const int fd = accept(server->listener, (struct sockaddr *)&from, &size);
    if (fd < 0) {
        return;
    }
    for (int i = 0; i < LINE_CLIENTS; i++) {
        line_client_t *c = &server->client[i];
        if (c->fd < 0 && set_nonblocking(fd)) {
            (void)setsockopt(fd, IPPROTO_TCP, TCP_NODELAY, &on, sizeof on);
            (void)setsockopt(fd, SOL_SOCKET, SO_SNDBUF, &send_size, sizeof send_size);
            c->fd = fd;
            c->in.framing = server->framing;
            c->peer = ntohs(from.sin_port);
            server->counts.connects++;
            return;
        }
    }
    server->counts.refused++;
    (void)close(fd);
}

static nfds_t collect(line_server_t *server, struct pollfd *fds)
{
    nfds_t n = 0;
    fds[n++] = (struct pollfd){.fd = server->listener, .events = POLLIN};
    for (int i = 0; i < LINE_CLIENTS; i++) {
        const line_client_t *c = &server->client[i];
        const short events = c->fd >= 0 ? line_client_wants(c) : 0;
        fds[n++] = (struct pollfd){.fd = events != 0 ? c->fd : -1, .events = events};
    }
    return n;
}

static void serve(line_server_t *server, const struct pollfd *fds)
{
    for (int i = 0; i < LINE_CLIENTS; i++) {
        line_client_t *c = &server->client[i];
        const short seen = fds[1 + i].fd >= 0 ? fds[1 + i].revents : 0;
        if ((seen & (POLLIN | POLLHUP | POLLERR)) != 0 && !c->ended) {
            line_client_read(c);
        }
        if (seen != 0 && c->out_end > c->out_begin) {
            line_client_write(c);
        }
    }
    if ((fds[0].revents & POLLIN) != 0) {
        client_accept(server);
    }
}

void line_server_wait(line_server_t *const *servers, int count, int timeout_ms)
{
    struct pollfd fds[SERVERS_MAX * (1 + LINE_CLIENTS)];
    nfds_t n = 0;
    for (int s = 0; s < count && s < SERVERS_MAX; s++) {
        n += collect(servers[s], fds + n);
    }
    if (poll(fds, n, timeout_ms) <= 0) {
        return; /* interrupted by a signal, for example */
    }
    for (int s = 0; s < count && s < SERVERS_MAX; s++) {
        serve(servers[s], fds + s * (1 + LINE_CLIENTS));
    }
}

static line_event_t client_next(line_server_t *server, line_client_t *c, char *text)
{
    if (c->fd < 0) {
        return LINE_NONE;
    }
    if (!c->greeted) {
        c->greeted = true;
        return LINE_OPENED;
    }
    if (line_buffer_next(&c->in, text)) {
        server->counts.texts++;
        return LINE_TEXT;
    }
    if (!c->ended) {
        return LINE_NONE;
    }
    server->counts.dropped += c->in.dropped + (line_buffer_empty(&c->in) ? 0U : 1U); /* an incomplete text counts */
    line_client_write(c);
    line_client_close(c);
    return LINE_CLOSED;
}

line_event_t line_server_next(line_server_t *server, int *client, char text[LINE_LENGTH + 1])
{
    for (int i = 0; i < LINE_CLIENTS; i++) {
        const int which = (server->next_client + i) % LINE_CLIENTS;
        const line_event_t event = client_next(server, &server->client[which], text);
        if (event != LINE_NONE) {
            *client = which;
            server->next_client = which + 1;
            return event;
        }
    }
    return LINE_NONE;
}

void line_server_send(line_server_t *server, int client, const char *text, size_t length)
{
    line_client_send(&server->client[client], text, length);
}

size_t line_server_backlog(const line_server_t *server)
{
    size_t longest = 0;
    for (int i = 0; i < LINE_CLIENTS; i++) {
        const line_client_t *c = &server->client[i];
        const size_t waits = c->fd >= 0 ? c->out_end - c->out_begin : 0U;
        longest = waits > longest ? waits : longest;
    }
    return longest;
}

void line_server_drop_slow(line_server_t *server, size_t bytes)
{
    for (int i = 0; i < LINE_CLIENTS; i++) {
        line_client_t *c = &server->client[i];
        if (c->fd >= 0 && !c->ended && c->out_end - c->out_begin > bytes) {
            server->counts.slow_clients++;
            c->out_begin = c->out_end = 0;
            c->ended = true;
        }
    }
}

uint16_t line_server_peer(const line_server_t *server, int client)
{
    return server->client[client].fd >= 0 ? server->client[client].peer : 0U;
}

bool line_server_connected(const line_server_t *server, int client)
{
    return server->client[client].fd >= 0 && !server->client[client].ended;
}
