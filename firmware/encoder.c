// Copyright 2026 hysteresis_ros contributors
// SPDX-License-Identifier: Apache-2.0
#include "encoder.h"

#include "hal.h"

static struct position position;
static struct quadrature seen;

void encoder_start(void)
{
    hal_read_quadrature(&seen);
    encoder_zero();
}

void encoder_zero(void)
{
    encoder_follow();
    position = (struct position){0};
}

void encoder_follow(void)
{
    struct quadrature now;
    hal_read_quadrature(&now);
    position.counts += (int16_t)(now.counts - seen.counts);
    position.counts_lost |= now.missed != seen.missed;
    if (now.indices != seen.indices) {
        position.indices += (uint16_t)(now.indices - seen.indices);
        position.latch = position.counts + (int16_t)(now.latch - now.counts);
        position.has_latch = true;
    }
    seen = now;
}

const struct position *encoder_position(void)
{
    return &position;
}
