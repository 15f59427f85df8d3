// Copyright 2026 hysteresis_ros contributors
// SPDX-License-Identifier: Apache-2.0
//
// All that the firmware wants from hardware. avr/ is the ATmega328P, host/ is a computer.
// Nothing here waits.
#ifndef HAL_H
#define HAL_H

#include <stdbool.h>
#include <stdint.h>

#include "flash.h"
#include "quadrature.h"

// Duty in steps: 0 is off, PWM_STEPS is always on. Four times 255, so that a timer of 8 bits can
// make the same mean as one of 16.
#define PWM_STEPS 1020

void hal_start(void);
uint32_t hal_time(void);                            // ms since the start, modulo 2^32
bool hal_read(uint8_t *byte);                       // false: nothing has come
bool hal_write(const char *data, uint8_t length);   // the whole, or false and nothing
void hal_set_pwm(uint16_t steps);                   // all three channels
void hal_read_quadrature(struct quadrature *copy);
bool hal_read_supply(uint16_t *millivolts);         // false: not measured yet
bool hal_stop_is_open(void);                        // emergency stop pressed, or its wire broken
uint16_t hal_boot(void);                            // another number at each start
const FLASH char *hal_reset_cause(void);
void hal_feed_watchdog(void);                       // else the chip starts anew

#endif
