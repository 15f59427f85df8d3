// Copyright 2026 hysteresis_ros contributors
// SPDX-License-Identifier: Apache-2.0
#include "telemetry.h"

#include "config.h"
#include "encoder.h"
#include "hal.h"
#include "output.h"
#include "writer.h"

static uint32_t period;
static uint32_t next;

void telemetry_start(uint32_t now)
{
    period = 0;
    telemetry_set_period(FIRST_PERIOD, now);
}

void telemetry_set_period(uint32_t milliseconds, uint32_t now)
{
    const uint32_t before = period;
    period = milliseconds < SHORTEST_PERIOD ? SHORTEST_PERIOD
             : milliseconds > LONGEST_PERIOD ? LONGEST_PERIOD : milliseconds;
    if (period != before) {     // a host that says it again and again keeps nothing from coming
        next = now + period;
    }
}

static void write_faults(uint8_t faults, bool counts_lost)
{
    const char *comma = "";
    writer_key(TEXT("faults"));
    if (counts_lost) {
        writer_text(TEXT("counts_lost"));
        comma = ",";
    }
    static const FLASH char names[][9] = {"power", "stop", "supply", "watchdog"};
    for (uint8_t i = 0; i < sizeof names / sizeof names[0]; i++) {
        if (faults >> i & 1) {
            if (*comma) {
                writer_character(*comma);
            }
            writer_text(names[i]);
            comma = ",";
        }
    }
    if (!*comma) {
        writer_text(TEXT("none"));
    }
}

static void send(uint32_t now)
{
    const struct position *const position = encoder_position();
    const struct output *const output = output_state();
    const uint32_t duty = ((uint32_t)output->steps * 100000 + PWM_STEPS / 2) / PWM_STEPS;
    writer_begin(TEXT("tele"));
    writer_unsigned(TEXT("time"), now);
    writer_signed(TEXT("counts"), position->counts);
    writer_unsigned(TEXT("index"), position->indices);
    if (position->has_latch) {
        writer_signed(TEXT("latch"), position->latch);
    }
    writer_decimal(TEXT("supply"), output->supply, 3);
    writer_decimal(TEXT("duty"), duty, 5);
    writer_unsigned(TEXT("on"), output->enabled);
    if (output->has_accepted) {
        writer_unsigned(TEXT("accepted"), output->accepted);
    }
    writer_unsigned(TEXT("obeyed"), output->obeyed);
    write_faults(output->faults, position->counts_lost);
    writer_end();
}

void telemetry_send_if_due(uint32_t now)
{
    if ((int32_t)(now - next) < 0) {
        if (next - now > period) {      // the clock has jumped back
            next = now + period;
        }
        return;
    }
    next += period;
    send(now);
}
