// Copyright 2026 hysteresis_ros contributors
// SPDX-License-Identifier: Apache-2.0
//
// Position of the encoder in 32 bits, from counters of 16 that wrap.
#ifndef ENCODER_H
#define ENCODER_H

#include <stdbool.h>
#include <stdint.h>

struct position {
    int32_t counts;
    int32_t latch;          // counts at the latest index pulse
    uint16_t indices;       // index pulses since the start or zero
    bool has_latch;
    bool counts_lost;       // edges came too fast since the start or zero
};

void encoder_start(void);
void encoder_follow(void);  // at least once in 32767 edges
void encoder_zero(void);
const struct position *encoder_position(void);

#endif
