// Copyright 2026 hysteresis_ros contributors
// SPDX-License-Identifier: Apache-2.0
//
// Three gates at 980 Hz, high for the same share of the time.
//
// Timer 1 counts to PWM_STEPS and back, for two of them; timer 2 counts to 255 and back as often,
// for the third, and makes up for its missing two bits by one step more in some of the periods:
// over four ms the mean is the same. Both are correct in phase, so that 0 is low without a spike.
#include <avr/interrupt.h>
#include <avr/io.h>
#include <util/atomic.h>

#include "../hal.h"
#include "parts.h"

#define GATES (_BV(PB1) | _BV(PB2) | _BV(PB3))
#define LAMP _BV(PB5)

static volatile uint8_t coarse;     // steps / 4
static volatile uint8_t fine;       // steps % 4
static uint8_t due;                 // quarters of a step of timer 2 not given yet

// In each ms of the clock.
ISR(TIMER0_COMPB_vect)
{
    const uint8_t quarters = due + fine;
    OCR2A = (uint8_t)(coarse + (quarters >> 2));
    due = quarters & 3;
}

void pwm_start(void)
{
    PORTB &= (uint8_t)~(GATES | LAMP);
    DDRB |= GATES | LAMP;
    ICR1 = PWM_STEPS;
    OCR1A = 0;
    OCR1B = 0;
    OCR2A = 0;
    TCCR1A = _BV(COM1A1) | _BV(COM1B1);
    TCCR1B = _BV(WGM13) | _BV(CS11);
    TCCR2A = _BV(COM2A1) | _BV(WGM20);
    TCCR2B = _BV(CS21) | _BV(CS20);
    OCR0B = 1;                  // once in each period of the clock, not when that interrupts
    TIMSK0 |= _BV(OCIE0B);
}

void hal_set_pwm(uint16_t steps)
{
    OCR1A = steps;
    OCR1B = steps;
    ATOMIC_BLOCK(ATOMIC_FORCEON) {
        coarse = (uint8_t)(steps >> 2);
        fine = steps & 3;
        if (steps == 0) {
            due = 0;
        }
        OCR2A = coarse;
    }
    if (steps > 0) {
        PORTB |= LAMP;
    } else {
        PORTB &= (uint8_t)~LAMP;
    }
}
