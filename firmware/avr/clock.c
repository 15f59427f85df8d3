// Copyright 2026 hysteresis_ros contributors
// SPDX-License-Identifier: Apache-2.0
//
// Milliseconds, by timer 0, which also paces the third gate in pwm.c.
#include <avr/interrupt.h>
#include <avr/io.h>
#include <util/atomic.h>

#include "../hal.h"
#include "parts.h"

#define PRESCALER 64

static volatile uint32_t milliseconds;

ISR(TIMER0_COMPA_vect)
{
    milliseconds++;
}

void clock_start(void)
{
    TCCR0A = _BV(WGM01);
    OCR0A = F_CPU / PRESCALER / 1000 - 1;
    TIMSK0 |= _BV(OCIE0A);
    TCCR0B = _BV(CS01) | _BV(CS00);
}

uint32_t hal_time(void)
{
    uint32_t now;
    ATOMIC_BLOCK(ATOMIC_FORCEON) {
        now = milliseconds;
    }
    return now;
}
