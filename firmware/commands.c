// Copyright 2026 hysteresis_ros contributors
// SPDX-License-Identifier: Apache-2.0
#include "commands.h"

#include "config.h"
#include "encoder.h"
#include "hal.h"
#include "number.h"
#include "output.h"
#include "power.h"
#include "telemetry.h"
#include "writer.h"

static void greet(uint32_t now)
{
    writer_begin(TEXT("board"));
    writer_unsigned(TEXT("protocol"), PROTOCOL_VERSION);
    writer_word(TEXT("name"), TEXT("atmega328p"));
    writer_word(TEXT("firmware"), TEXT(FIRMWARE_VERSION));
    writer_unsigned(TEXT("boot"), hal_boot());
    writer_unsigned(TEXT("time"), now);
    writer_word(TEXT("bits"), TEXT("32"));
    writer_word(TEXT("reset"), hal_reset_cause());
    writer_unsigned(TEXT("watchdog"), LONGEST_WATCHDOG);
    writer_decimal(TEXT("limit"), DUTY_LIMIT_PERCENT, 2);
    writer_decimal(TEXT("rms"), RMS_LIMIT, 3);
    writer_end();
}

static bool read_number(const struct frame *frame, const FLASH char *key, struct number *number)
{
    struct text value;
    return frame_value(frame, key, &value) && number_read(value, number);
}

static bool read_integer(const struct frame *frame, const FLASH char *key, struct number *number)
{
    return read_number(frame, key, number) && !number->has_point;
}

static bool is_positive(const struct number *number)
{
    return !number->negative && number->whole > 0;
}

// What `config` may leave out; `result` stays as it is then.
static enum refusal read_rms(const struct frame *frame, uint32_t *result)
{
    struct text value;
    struct number rms;
    if (!frame_value(frame, TEXT("rms"), &value)) {
        return OBEYED;
    }
    if (!number_read(value, &rms)) {
        return NO_NUMBER;
    }
    if (rms.negative || (rms.whole == 0 && !rms.has_fraction)) {
        return OUT_OF_RANGE;
    }
    if (rms.whole < RMS_LIMIT / 1000 + 1) {     // more is as good as none
        *result = rms.whole * 1000 + rms.millionths / 1000;
    }
    return OBEYED;
}

static enum refusal read_window(const struct frame *frame, uint32_t *result)
{
    struct text value;
    struct number window;
    if (!frame_value(frame, TEXT("rms_window"), &value)) {
        return OBEYED;
    }
    if (!number_read(value, &window) || window.has_point) {
        return NO_NUMBER;
    }
    if (!is_positive(&window)) {
        return OUT_OF_RANGE;
    }
    *result = window.whole;
    return OBEYED;
}

static enum refusal configure(const struct frame *frame, uint32_t now)
{
    struct number period, watchdog;
    if (!read_integer(frame, TEXT("period"), &period)
        || !read_integer(frame, TEXT("watchdog"), &watchdog)) {
        return NO_NUMBER;
    }
    uint32_t limit = RMS_LIMIT, window = RMS_WINDOW;
    const enum refusal rms = read_rms(frame, &limit);
    const enum refusal rms_window = read_window(frame, &window);
    if (rms == NO_NUMBER || rms_window == NO_NUMBER) {
        return NO_NUMBER;
    }
    if (!is_positive(&period) || !is_positive(&watchdog) || rms || rms_window) {
        return OUT_OF_RANGE;
    }
    power_set_limit(limit, window);
    telemetry_set_period(period.whole, now);
    output_set_watchdog(watchdog.whole);
    return OBEYED;
}

static enum refusal set_duty(const struct frame *frame, uint32_t now)
{
    struct number duty;
    if (!read_number(frame, TEXT("duty"), &duty)) {
        return NO_NUMBER;
    }
    const bool is_zero = duty.whole == 0 && !duty.has_fraction;
    const bool above_one = duty.whole > 1 || (duty.whole == 1 && duty.has_fraction);
    if (above_one || (duty.negative && !is_zero)) {
        return OUT_OF_RANGE;
    }
    const uint16_t steps = duty.whole == 1 ? PWM_STEPS
                           : (uint16_t)((duty.millionths * PWM_STEPS + 500000UL) / 1000000UL);
    return output_set(steps, frame->sequence, now);
}

static void answer(enum refusal refusal, uint16_t sequence)
{
    static const FLASH char reasons[][27] = {
        [DISABLED] = "disabled",
        [OUT_OF_RANGE] = "out_of_range",
        [NO_SUPPLY] = "supply",
        [TOO_MUCH_POWER] = "power",
        [STOPPED] = "stop",
        [NO_NUMBER] = "field_missing_or_no_number",
        [UNKNOWN_COMMAND] = "unknown_command",
    };
    writer_begin(refusal == OBEYED ? TEXT("ok") : TEXT("no"));
    writer_unsigned(TEXT("re"), sequence);
    if (refusal != OBEYED) {
        writer_word(TEXT("reason"), reasons[refusal]);
    }
    writer_end();
}

void commands_obey(const struct frame *frame, uint32_t now)
{
    enum refusal refusal = OBEYED;
    bool answered_otherwise = false;
    if (text_is(frame->kind, TEXT("set"))) {
        refusal = set_duty(frame, now);
        answered_otherwise = refusal == OBEYED;     // telemetry shows it
    } else if (text_is(frame->kind, TEXT("hello"))) {
        greet(now);
        answered_otherwise = true;
    } else if (text_is(frame->kind, TEXT("config"))) {
        refusal = configure(frame, now);
    } else if (text_is(frame->kind, TEXT("enable"))) {
        refusal = output_enable(now);
    } else if (text_is(frame->kind, TEXT("disable"))) {
        output_disable();
    } else if (text_is(frame->kind, TEXT("zero"))) {
        encoder_zero();
    } else {
        refusal = UNKNOWN_COMMAND;
    }
    if (!answered_otherwise) {
        answer(refusal, frame->sequence);
    }
}
