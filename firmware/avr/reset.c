// Copyright 2026 hysteresis_ros contributors
// SPDX-License-Identifier: Apache-2.0
//
// How often the chip has started, why, and the watchdog that starts it anew when the loop hangs.
#include <avr/eeprom.h>
#include <avr/io.h>
#include <avr/wdt.h>

#include "../hal.h"
#include "parts.h"

#define PATIENCE WDTO_120MS

static uint16_t boot;
static uint16_t EEMEM starts;

// Writing takes up to 7 ms; the gates are low and the loop has not begun.
void reset_start(void)
{
    boot = (uint16_t)(eeprom_read_word(&starts) + 1);
    eeprom_update_word(&starts, boot);
    wdt_enable(PATIENCE);
}

uint16_t hal_boot(void)
{
    return boot;
}

const FLASH char *hal_reset_cause(void)
{
    if (reset_flags & _BV(WDRF)) {
        return TEXT("watchdog");
    }
    if (reset_flags & _BV(PORF)) {        // a start from nothing sets the brown-out's bit as well
        return TEXT("power");
    }
    if (reset_flags & _BV(BORF)) {
        return TEXT("brownout");
    }
    return TEXT("external");
}

void hal_feed_watchdog(void)
{
    wdt_reset();
}
