// Copyright 2026 hysteresis_ros contributors
// SPDX-License-Identifier: Apache-2.0
//
// Mean heating power: a running mean of the duty times the supply squared, which is the mean square
// of the voltage over the wires.
#ifndef POWER_H
#define POWER_H

#include <stdbool.h>
#include <stdint.h>

void power_start(uint32_t now);
// RMS in mV, no more than RMS_LIMIT, and the mean's time constant in ms.
void power_set_limit(uint32_t millivolts, uint32_t window);
void power_add(uint16_t steps, uint16_t supply, uint32_t now);  // applied since the last call
bool power_is_exceeded(void);

#endif
