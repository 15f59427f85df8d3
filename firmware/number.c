// Copyright 2026 hysteresis_ros contributors
// SPDX-License-Identifier: Apache-2.0
#include "number.h"

#define MOST_DIGITS 10

static bool is_digit(char character)
{
    return character >= '0' && character <= '9';
}

// Count the digits at the start of a text.
static uint8_t digits(struct text text)
{
    uint8_t count = 0;
    while (count < text.length && is_digit(text.start[count])) {
        count++;
    }
    return count;
}

static struct text rest(struct text text, uint8_t from)
{
    return (struct text){text.start + from, (uint8_t)(text.length - from)};
}

static uint32_t append(uint32_t value, uint8_t digit)
{
    const uint32_t most = UINT32_MAX;
    if (value > most / 10 || (value == most / 10 && digit > most % 10)) {
        return most;
    }
    return value * 10 + digit;
}

static void read_fraction(struct text text, struct number *number)
{
    uint32_t unit = 100000;     // millionths that a digit at this place is worth
    for (uint8_t i = 0; i < text.length; i++) {
        const uint8_t digit = (uint8_t)(text.start[i] - '0');
        number->millionths += digit * unit;
        number->has_fraction |= digit != 0;
        unit /= 10;
    }
}

bool number_read(struct text text, struct number *number)
{
    *number = (struct number){0};
    if (text.length > 0 && text.start[0] == '-') {
        number->negative = true;
        text = rest(text, 1);
    }
    const uint8_t before = digits(text);
    if (before == 0 || before > MOST_DIGITS) {
        return false;
    }
    for (uint8_t i = 0; i < before; i++) {
        number->whole = append(number->whole, (uint8_t)(text.start[i] - '0'));
    }
    text = rest(text, before);
    if (text.length == 0) {
        return true;
    }
    if (text.start[0] != '.') {
        return false;
    }
    number->has_point = true;
    text = rest(text, 1);
    if (text.length == 0 || text.length > MOST_DIGITS || digits(text) != text.length) {
        return false;
    }
    read_fraction(text, number);
    return true;
}
