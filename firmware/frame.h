// Copyright 2026 hysteresis_ros contributors
// SPDX-License-Identifier: Apache-2.0
//
// What one line says: `kind sequence key=value ...*CRC`.
#ifndef FRAME_H
#define FRAME_H

#include "text.h"

#define MAX_LINE 192            // bytes, newline included

enum line {
    LINE_NONE,                  // not complete, or empty: it only ends what came before it
    LINE_FRAME,
    LINE_REMARK,                // for people, skipped
    LINE_TOO_LONG,
    LINE_WITHOUT_CRC,
    LINE_WRONG_CRC,
    LINE_WRONG_FORM,
    LINE_WRONG_FIELDS,          // a key twice, or a sequence number above 65535
};

struct frame {
    struct text kind;
    struct text fields;         // " key=value key=value"
    uint16_t sequence;
    uint16_t crc;               // that would have made a bad line right,
    bool has_crc;               // where one could
};

enum line frame_parse(struct text line, struct frame *frame);
bool frame_value(const struct frame *frame, const FLASH char *key, struct text *value);

#endif
