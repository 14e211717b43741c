/* SPDX-License-Identifier: Apache-2.0 */
#include "line_buffer.h"

#include <string.h>

size_t line_buffer_free(line_buffer_t *b)
{
    memmove(b->bytes, b->bytes + b->begin, b->end - b->begin);
    b->end -= b->begin;
    b->begin = 0;
    return sizeof b->bytes - b->end;
}

/* Takes the text that starts at `from` and ends before `to`, the position of the delimiter. */
static bool take(line_buffer_t *b, size_t from, size_t to, char *text)
{
    const size_t length = to - from;
    const bool good = !b->skipping && length <= LINE_LENGTH && memchr(b->bytes + from, '\0', length) == NULL;
    if (good) {
        memcpy(text, b->bytes + from, length);
        text[length] = '\0';
    }
    b->begin = to + 1U;
    b->dropped += (good || b->skipping) ? 0U : 1U; /* a skipped text has been counted already */
    b->skipping = false;
    return good;
}

/* Discards input that cannot become a text. */
static void give_up(line_buffer_t *b)
{
    b->dropped += b->skipping ? 0U : 1U;
    b->skipping = true;
    b->begin = b->end;
}

static bool next_line(line_buffer_t *b, char *text)
{
    const char *end;
    while ((end = memchr(b->bytes + b->begin, '\n', b->end - b->begin)) != NULL) {
        const size_t to = (size_t)(end - b->bytes);
        if (take(b, b->begin, to, text)) {
            return true;
        }
    }
    if (b->end - b->begin > LINE_LENGTH) {
        give_up(b);
    }
    return false;
}

/* Only white space is allowed between '>' and '<'. */
static void skip_to_bracket(line_buffer_t *b)
{
    bool rubbish = false;
    while (b->begin < b->end && b->bytes[b->begin] != '<') {
        rubbish = rubbish || memchr(" \t\r\n", b->bytes[b->begin], 4) == NULL;
        b->begin++;
    }
    b->dropped += rubbish ? 1U : 0U;
}

static bool next_bracketed(line_buffer_t *b, char *text)
{
    for (;;) {
        skip_to_bracket(b);
        if (b->begin == b->end) {
            return false;
        }
        size_t at = b->begin + 1U;
        while (at < b->end && b->bytes[at] != '>' && b->bytes[at] != '<') {
            at++;
        }
        if (at == b->end) {
            if (at - b->begin > LINE_LENGTH) {
                b->dropped++;
                b->begin = b->end; /* the rest before the next '<' is invalid */
            }
            return false;
        }
        if (b->bytes[at] == '<') { /* the text before it has no end */
            b->dropped++;
            b->begin = at;
        } else if (take(b, b->begin + 1U, at, text)) {
            return true;
        }
    }
}

bool line_buffer_next(line_buffer_t *b, char text[LINE_LENGTH + 1])
{
    return b->framing == LINE_BY_NEWLINE ? next_line(b, text) : next_bracketed(b, text);
}

bool line_buffer_empty(const line_buffer_t *b)
{
    return b->begin == b->end;
}
