// Copyright 2026 hysteresis_ros contributors
// SPDX-License-Identifier: Apache-2.0
//
// The encoder's tracks on the two fastest interrupts, its index pulse on another.
#include <avr/interrupt.h>
#include <avr/io.h>
#include <util/atomic.h>

#include "../hal.h"
#include "parts.h"

#define TRACKS (_BV(PD2) | _BV(PD3))
#define INDEX _BV(PD4)

static volatile struct quadrature state;

ISR(INT0_vect)
{
    quadrature_edge(&state, PIND & TRACKS);
}

ISR(INT1_vect, ISR_ALIASOF(INT0_vect));

ISR(PCINT2_vect)
{
    if (PIND & INDEX) {
        quadrature_index(&state);
    }
}

void encoder_pins_start(void)
{
    PORTD |= TRACKS | INDEX;        // pulled up: a broken wire is quiet
    EICRA = _BV(ISC00) | _BV(ISC10);    // at every edge
    EIFR = _BV(INTF0) | _BV(INTF1);     // what came before that does not count
    EIMSK = _BV(INT0) | _BV(INT1);
    state.before = (PIND & TRACKS) >> 2;
    PCMSK2 = _BV(PCINT20);
    PCICR = _BV(PCIE2);
}

void hal_read_quadrature(struct quadrature *copy)
{
    ATOMIC_BLOCK(ATOMIC_FORCEON) {
        copy->counts = state.counts;    // by name: the loop that copies a whole is slow
        copy->indices = state.indices;
        copy->latch = state.latch;
        copy->missed = state.missed;
    }
}
