// Copyright 2026 hysteresis_ros contributors
// SPDX-License-Identifier: Apache-2.0
#include "remarks.h"

#include "config.h"
#include "writer.h"

#define MOST_SHOWN 60           // characters of a bad line

static uint32_t last;           // time of the latest explanation

#define STRING_(x) #x
#define STRING(x) STRING_(x)

void remarks_start(uint32_t now)
{
    last = now - REMARK_PERIOD;
    writer_remark();
    writer_text(TEXT("hysteresis_ros firmware " FIRMWARE_VERSION ", protocol "
                     STRING(PROTOCOL_VERSION) "; say \"hello 1*DEB9\""));
    writer_end_remark();
}

static const FLASH char *reason(enum line what)
{
    switch (what) {
    case LINE_TOO_LONG:
        return TEXT("longer than " STRING(MAX_LINE) " bytes");
    case LINE_WITHOUT_CRC:
        return TEXT("no CRC at its end");
    case LINE_WRONG_CRC:
        return TEXT("its CRC is wrong");
    case LINE_WRONG_FORM:
        return TEXT("not of the form \"kind sequence key=value\"");
    default:
        return TEXT("a key twice, or a sequence number above 65535");
    }
}

// Show a line as printable characters, \xNN for the others, no more than MOST_SHOWN in all.
static void show(struct text line)
{
    uint8_t shown = 0;
    for (uint8_t i = 0; i < line.length && shown < MOST_SHOWN; i++) {
        const char character = line.start[i];
        if (character >= ' ' && character <= '~') {
            writer_character(character);
            shown++;
            continue;
        }
        if (shown++ < MOST_SHOWN) {
            writer_character('\\');
        }
        if (shown++ < MOST_SHOWN) {
            writer_character('x');
        }
        for (int8_t shift = 4; shift >= 0; shift -= 4) {
            if (shown++ < MOST_SHOWN) {
                writer_hexadecimal((uint8_t)character >> shift & 0xF, 1, false);
            }
        }
    }
}

void remarks_explain(enum line what, const struct frame *frame, struct text line, uint32_t now)
{
    if (now - last < REMARK_PERIOD) {
        return;
    }
    last = now;
    if (line.length > 0 && what != LINE_TOO_LONG && line.start[line.length - 1] == '\r') {
        line.length--;
    }
    writer_remark();
    writer_text(TEXT("nothing done, "));
    writer_text(reason(what));
    if (frame->has_crc) {
        writer_text(TEXT("; its CRC would be *"));
        writer_hexadecimal(frame->crc, 4, true);
    }
    writer_text(TEXT(": "));
    show(line);
    writer_end_remark();
}
