/* SPDX-License-Identifier: Apache-2.0 */
#ifndef VECU_SOCKETCAND_H
#define VECU_SOCKETCAND_H
/** The texts of the socketcand protocol's raw mode.
 *   client  < open <bus> >  < rawmode >  < send <id> <length> <byte> ... >
 *   server  < hi >  < ok >  < frame <id> <s.us> <data> >
 * Source   the protocol description of github.com/linux-can/socketcand; checked against python-can's client
 * Range    identifiers of 1 to 3 hexadecimal digits are standard, of 8 extended; 0 to 8 bytes
 * Errors   SOCKETCAND_BAD for everything else: a number of bytes other than the announced one, characters that are not
 *          digits, a value that is too large
 * Context  simulation only; pure */
#include <stddef.h>
#include <stdint.h>

#include "types/can_frame.h"

typedef enum { SOCKETCAND_BAD, SOCKETCAND_OPEN, SOCKETCAND_RAW, SOCKETCAND_SEND } socketcand_t;

enum { SOCKETCAND_TEXT = 80 };

/** The command in a text without its brackets; the frame is written for SOCKETCAND_SEND. */
socketcand_t socketcand_parse(const char *text, can_frame_t *frame);
/** The frame as a text with its brackets; answers its length. */
size_t socketcand_format(char text[SOCKETCAND_TEXT], const can_frame_t *frame, uint64_t time_ns);

#endif
