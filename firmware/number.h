// Copyright 2026 hysteresis_ros contributors
// SPDX-License-Identifier: Apache-2.0
//
// Plain numbers as the protocol writes them: -12, 0.2345. No exponents, so no NaN.
#ifndef NUMBER_H
#define NUMBER_H

#include "text.h"

struct number {
    bool negative;          // a minus sign, also before a zero
    bool has_point;
    bool has_fraction;      // a digit other than 0 after the point
    uint32_t whole;         // 2^32 - 1 where it is more than that
    uint32_t millionths;    // cut off after six digits
};

bool number_read(struct text text, struct number *number);

#endif
