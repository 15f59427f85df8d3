// Copyright 2026 hysteresis_ros contributors
// SPDX-License-Identifier: Apache-2.0
//
// What a test does to the firmware that runs on a computer: time, bytes, pins and voltages.
#ifndef HOST_H
#define HOST_H

#include <stdbool.h>
#include <stdint.h>

void host_start(void);                      // power on; each time is another boot
void host_advance(uint32_t milliseconds);   // with passes of the loop in every one of them
void host_step(void);                       // one pass, no time
void host_leap(uint32_t milliseconds);      // time without a pass: weeks in an instant
void host_receive(const uint8_t *data, uint32_t length);
uint32_t host_transmit(uint8_t *data, uint32_t most);
void host_tracks(bool a, bool b);
void host_index(void);
void host_set_supply(uint16_t millivolts);
void host_open_stop(bool open);
void host_jam_port(bool jammed);            // no room for what is written
uint16_t host_pwm(void);
uint32_t host_fed(void);                    // how often the watchdog of the chip was fed

#endif
