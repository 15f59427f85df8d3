// Copyright 2026 hysteresis_ros contributors
// SPDX-License-Identifier: Apache-2.0
#include "text.h"

bool text_is(struct text text, const FLASH char *word)
{
    for (uint8_t i = 0; i < text.length; i++) {
        if (word[i] != text.start[i]) {     // also where the word ends
            return false;
        }
    }
    return word[text.length] == '\0';
}

bool text_equal(struct text one, struct text other)
{
    if (one.length != other.length) {
        return false;
    }
    for (uint8_t i = 0; i < one.length; i++) {
        if (one.start[i] != other.start[i]) {
            return false;
        }
    }
    return true;
}
