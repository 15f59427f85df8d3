// Copyright 2026 hysteresis_ros contributors
// SPDX-License-Identifier: Apache-2.0
//
// The emergency stop: a contact to ground that opens. A broken wire stops as well.
#include <avr/io.h>

#include "../hal.h"
#include "parts.h"

void stop_start(void)
{
    PORTD |= _BV(PD7);
}

bool hal_stop_is_open(void)
{
    return PIND & _BV(PD7);
}
