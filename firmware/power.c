// Copyright 2026 hysteresis_ros contributors
// SPDX-License-Identifier: Apache-2.0
#include "power.h"

#include "config.h"
#include "hal.h"

#define TICK 100                // ms over which the duty is averaged before it enters the mean

static uint32_t mean;           // mV^2
static uint32_t most;           // mV^2
static uint32_t ticks;          // in the window
static uint32_t begun;          // when this tick began
static uint32_t last;           // when the duty was last added
static uint32_t steps_sum;      // of steps times ms in this tick

void power_start(uint32_t now)
{
    mean = steps_sum = 0;
    begun = last = now;
    power_set_limit(RMS_LIMIT, RMS_WINDOW);
}

void power_set_limit(uint32_t millivolts, uint32_t window)
{
    millivolts = millivolts < RMS_LIMIT ? millivolts : RMS_LIMIT;
    window = window < LONGEST_RMS_WINDOW ? window : LONGEST_RMS_WINDOW;
    most = millivolts * millivolts;
    ticks = window > TICK ? window / TICK : 1;
}

void power_add(uint16_t steps, uint16_t supply, uint32_t now)
{
    steps_sum += steps * (now - last);
    last = now;
    const uint32_t passed = now - begun;
    if (passed < TICK) {
        return;
    }
    const uint32_t square = (uint32_t)supply * supply / PWM_STEPS * (steps_sum / passed);
    // Without a sign: both may be as large as 32 bits allow.
    if (square > mean) {
        mean += (square - mean) / ticks;
    } else {
        mean -= (mean - square) / ticks;
    }
    begun = now;
    steps_sum = 0;
}

bool power_is_exceeded(void)
{
    return mean > most;
}
