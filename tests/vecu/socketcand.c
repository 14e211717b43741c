/* SPDX-License-Identifier: Apache-2.0 */
#include "socketcand.h"

#include <stdbool.h>
#include <stdio.h>
#include <string.h>

static const char *skip_spaces(const char *at)
{
    return at + strspn(at, " ");
}

static int digit(char c)
{
    if (c >= '0' && c <= '9') {
        return c - '0';
    }
    if (c >= 'a' && c <= 'f') {
        return c - 'a' + 10;
    }
    return (c >= 'A' && c <= 'F') ? c - 'A' + 10 : -1;
}

/* Parses a hexadecimal word; returns the number of digits, 0 if it is not one or has more than 8. */
static int hex_word(const char **at, uint32_t *value)
{
    const char *s = skip_spaces(*at);
    int digits = 0;
    *value = 0;
    while (digit(*s) >= 0 && digits < 8) {
        *value = *value << 4 | (uint32_t)digit(*s);
        digits++;
        s++;
    }
    *at = s;
    return (*s == ' ' || *s == '\0') ? digits : 0;
}

static bool parse_frame(const char *at, can_frame_t *frame)
{
    uint32_t value;
    const int digits = hex_word(&at, &value);
    memset(frame, 0, sizeof *frame);
    frame->id = value;
    frame->extended = digits == 8;
    if (digits == 0 || (digits > 3 && digits < 8) || value > (frame->extended ? 0x1FFFFFFFU : 0x7FFU) ||
        hex_word(&at, &value) != 1 || value > 8U) {
        return false;
    }
    frame->length = (uint8_t)value;
    for (unsigned i = 0; i < frame->length; i++) {
        const int width = hex_word(&at, &value);
        if (width < 1 || width > 2) {
            return false;
        }
        frame->data[i] = (uint8_t)value;
    }
    return *skip_spaces(at) == '\0';
}

socketcand_t socketcand_parse(const char *text, can_frame_t *frame)
{
    const char *at = skip_spaces(text);
    if (strncmp(at, "send ", 5) == 0) {
        return parse_frame(at + 5, frame) ? SOCKETCAND_SEND : SOCKETCAND_BAD;
    }
    if (strncmp(at, "open ", 5) == 0) {
        return SOCKETCAND_OPEN; /* there is one bus; it answers to every name */
    }
    if (strncmp(at, "rawmode", 7) == 0 && *skip_spaces(at + 7) == '\0') {
        return SOCKETCAND_RAW;
    }
    return SOCKETCAND_BAD;
}

static char *put_hex(char *at, uint32_t value, int digits)
{
    for (int i = digits - 1; i >= 0; i--) {
        *at++ = "0123456789ABCDEF"[value >> (4 * i) & 0xFU];
    }
    return at;
}

size_t socketcand_format(char text[SOCKETCAND_TEXT], const can_frame_t *frame, uint64_t time_ns)
{
    const unsigned long long us = time_ns / 1000U;
    char *at = text;
    memcpy(at, "< frame ", 8);
    at = put_hex(at + 8, frame->id, frame->extended ? 8 : 3);
    at += snprintf(at, 32, " %llu.%06llu ", us / 1000000U, us % 1000000U);
    for (unsigned i = 0; i < frame->length; i++) {
        at = put_hex(at, frame->data[i], 2);
    }
    memcpy(at, " >", 3);
    return (size_t)(at + 2 - text);
}
