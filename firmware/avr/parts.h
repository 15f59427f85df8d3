// Copyright 2026 hysteresis_ros contributors
// SPDX-License-Identifier: Apache-2.0
//
// The parts of the ATmega328P that the firmware uses, each started once by hal_start.
//
//   PB1 (D9), PB2 (D10), PB3 (D11)  gates of the three MOSFETs
//   PB5 (D13)                       the board's lamp: lit while heating
//   PD2 (D2), PD3 (D3), PD4 (D4)    encoder A, B, index
//   PD7 (D7)                        emergency stop: closed to ground while all is well
//   PC0 (A0)                        supply voltage over a divider
#ifndef PARTS_H
#define PARTS_H

#include <stdint.h>

extern uint8_t reset_flags;     // of the register MCUSR at the start

void clock_start(void);
void encoder_pins_start(void);
void pwm_start(void);
void reset_start(void);
void stop_start(void);
void supply_start(void);
void uart_start(void);

#endif
