// Copyright 2026 hysteresis_ros contributors
// SPDX-License-Identifier: Apache-2.0
//
// Two tracks a quarter of a period apart, and an index pulse, counted: every edge is one count.
//
// These functions run in interrupts, up to 100,000 times a second. They keep 16 bits, which the
// processor adds in a few cycles; encoder.c makes 32 of them.
#ifndef QUADRATURE_H
#define QUADRATURE_H

#include <stdint.h>

struct quadrature {
    uint16_t counts;
    uint16_t indices;       // index pulses
    uint16_t latch;         // counts at the latest of them
    uint8_t missed;         // edges that came too fast to tell their direction
    uint8_t before;         // the tracks as last seen: A is bit 0, B is bit 1
};

#define MISSED 2
// By (tracks now) * 4 + (tracks before). Counts grow while A leads: 00, 01, 11, 10 in bits B, A.
extern const int8_t quadrature_steps[16];

// Take the tracks at an edge, as now * 4 in bits 2 and 3.
static inline void quadrature_edge(volatile struct quadrature *state, uint8_t now)
{
    const int8_t step = quadrature_steps[now | state->before];
    state->before = now >> 2;
    if (step == MISSED) {
        state->missed++;
    } else {
        state->counts += (uint16_t)(int16_t)step;
    }
}

static inline void quadrature_index(volatile struct quadrature *state)
{
    state->indices++;
    state->latch = state->counts;
}

#endif
