// Copyright 2026 hysteresis_ros contributors
// SPDX-License-Identifier: Apache-2.0
//
// A piece of a received line: characters that belong to somebody else, with their number.
#ifndef TEXT_H
#define TEXT_H

#include <stdbool.h>
#include <stdint.h>

#include "flash.h"

struct text {
    const char *start;
    uint8_t length;
};

bool text_is(struct text text, const FLASH char *word);
bool text_equal(struct text one, struct text other);

#endif
