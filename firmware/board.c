// Copyright 2026 hysteresis_ros contributors
// SPDX-License-Identifier: Apache-2.0
#include "board.h"

#include "commands.h"
#include "decoder.h"
#include "encoder.h"
#include "hal.h"
#include "output.h"
#include "remarks.h"
#include "telemetry.h"
#include "writer.h"

// Bytes taken in one pass: a host that floods the line must not keep the rest waiting.
#define MOST_BYTES 32

static uint32_t last_fed;

void board_start(void)
{
    const uint32_t now = hal_time();
    last_fed = now;
    output_start(now);
    decoder_start();
    writer_start();
    encoder_start();
    telemetry_start(now);
    remarks_start(now);
}

static void listen(uint32_t now)
{
    struct frame frame;
    uint8_t byte;
    for (uint8_t i = 0; i < MOST_BYTES && hal_read(&byte); i++) {
        const enum line line = decoder_feed(byte, &frame);
        if (line == LINE_FRAME) {
            commands_obey(&frame, now);
        } else if (line != LINE_NONE && line != LINE_REMARK) {
            remarks_explain(line, &frame, decoder_text(), now);
        }
    }
}

void board_step(void)
{
    const uint32_t now = hal_time();
    encoder_follow();
    output_watch(now);
    listen(now);
    telemetry_send_if_due(now);
    // Only while the clock runs: without it, no setpoint would ever be too old.
    if (now != last_fed) {
        last_fed = now;
        hal_feed_watchdog();
    }
}
