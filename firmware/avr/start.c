// Copyright 2026 hysteresis_ros contributors
// SPDX-License-Identifier: Apache-2.0
//
// All parts, in the order that keeps the gates low from the first instruction on.
#include <avr/interrupt.h>

#include "../hal.h"
#include "parts.h"

void hal_start(void)
{
    pwm_start();
    stop_start();
    supply_start();
    encoder_pins_start();
    uart_start();
    clock_start();
    reset_start();
    sei();
}
