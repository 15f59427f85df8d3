// Copyright 2026 hysteresis_ros contributors
// SPDX-License-Identifier: Apache-2.0
//
// The supply voltage, measured against the chip's own 1.1 V, so that USB's 5 V do not matter.
#include <avr/io.h>

#include "../config.h"
#include "../hal.h"
#include "parts.h"

#define SAMPLES 64              // whose mean is a measurement: 6.7 ms, several periods of the PWM

static uint16_t sum;            // up to 64 * 1023
static uint8_t count;
static uint16_t latest;         // mV
static bool measured;

void supply_start(void)
{
    ADMUX = _BV(REFS1) | _BV(REFS0);    // channel 0
    DIDR0 = _BV(ADC0D);
    ADCSRA = _BV(ADEN) | _BV(ADPS2) | _BV(ADPS1) | _BV(ADPS0) | _BV(ADSC);
}

bool hal_read_supply(uint16_t *millivolts)
{
    if (!(ADCSRA & _BV(ADSC))) {
        sum += ADC;
        ADCSRA |= _BV(ADSC);
        if (++count == SAMPLES) {
            latest = (uint16_t)((uint32_t)sum * SUPPLY_FULL_SCALE >> 16);
            measured = true;
            count = 0;
            sum = 0;
        }
    }
    *millivolts = latest;
    return measured;
}
