// Copyright 2026 hysteresis_ros contributors
// SPDX-License-Identifier: Apache-2.0
#include "decoder.h"

static char line[MAX_LINE];
static uint8_t length;
static bool ended;          // the line in the buffer was complete: the next byte begins another

void decoder_start(void)
{
    length = 0;
    ended = false;
}

enum line decoder_feed(uint8_t byte, struct frame *frame)
{
    if (ended) {
        decoder_start();
    }
    if (byte != '\n') {
        if (length < MAX_LINE) {
            line[length++] = (char)byte;
        }
        return LINE_NONE;
    }
    ended = true;
    if (length == MAX_LINE) {
        frame->has_crc = false;
        return LINE_TOO_LONG;
    }
    return frame_parse(decoder_text(), frame);
}

struct text decoder_text(void)
{
    return (struct text){line, length};
}
