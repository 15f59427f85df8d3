// Copyright 2026 hysteresis_ros contributors
// SPDX-License-Identifier: Apache-2.0
//
// Whether the muscle is heated, and everything that forbids it.
#ifndef OUTPUT_H
#define OUTPUT_H

#include <stdbool.h>
#include <stdint.h>

#include "flash.h"

enum refusal {
    OBEYED,
    DISABLED,
    OUT_OF_RANGE,
    NO_SUPPLY,
    TOO_MUCH_POWER,
    STOPPED,
    NO_NUMBER,
    UNKNOWN_COMMAND,
};

enum fault {
    FAULT_POWER = 1,
    FAULT_STOP = 2,
    FAULT_SUPPLY = 4,
    FAULT_WATCHDOG = 8,
};

struct output {
    uint16_t steps;         // applied now, of PWM_STEPS
    uint16_t supply;        // mV
    uint16_t accepted;      // sequence number of the latest set that was obeyed,
    bool has_accepted;      // if there was one
    uint16_t obeyed;        // how many there were
    bool enabled;
    uint8_t faults;
};

void output_start(uint32_t now);
void output_watch(uint32_t now);            // in every pass of the loop: switches off where it must
void output_set_watchdog(uint32_t milliseconds);
enum refusal output_enable(uint32_t now);
void output_disable(void);
enum refusal output_set(uint16_t steps, uint16_t sequence, uint32_t now);
const struct output *output_state(void);

#endif
