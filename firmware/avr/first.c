// Copyright 2026 hysteresis_ros contributors
// SPDX-License-Identifier: Apache-2.0
//
// The first instructions after a reset, before memory is set up.
#include <avr/io.h>
#include <avr/wdt.h>

#include "parts.h"

// Not set to zero at the start: written before that.
uint8_t reset_flags __attribute__((section(".noinit")));

// After a reset by the watchdog it goes on running, at its shortest time: it has to be stopped at
// once. Optiboot clears the register and hands its content on in r2.
void first_instructions(void) __attribute__((naked, used, section(".init3")));
void first_instructions(void)
{
    uint8_t from_bootloader;
    __asm__ volatile("mov %0, r2" : "=r"(from_bootloader));
    reset_flags = MCUSR ? MCUSR : from_bootloader;
    MCUSR = 0;
    wdt_disable();
}
