// Copyright 2026 hysteresis_ros contributors
// SPDX-License-Identifier: Apache-2.0
#include "writer.h"

#include "crc16.h"
#include "frame.h"
#include "hal.h"

#define ENDING 6                // "*CRC4" and newline
#define MOST_DIGITS 10          // of 32 bits

static char line[MAX_LINE];
static uint8_t length;
static bool overflow;
static uint16_t sequence;

void writer_start(void)
{
    sequence = 0;
}

void writer_character(char character)
{
    if (length < MAX_LINE - ENDING) {
        line[length++] = character;
    } else {
        overflow = true;
    }
}

void writer_text(const FLASH char *text)
{
    while (*text != '\0') {
        writer_character(*text++);
    }
}

// Write a whole number, with zeros in front where it has fewer digits than asked for.
static void write_digits(uint32_t value, uint8_t fewest)
{
    char digits[MOST_DIGITS];
    uint8_t count = 0;
    do {
        digits[count++] = (char)('0' + value % 10);
        value /= 10;
    } while (value > 0 || count < fewest);
    while (count > 0) {
        writer_character(digits[--count]);
    }
}

void writer_hexadecimal(uint16_t value, uint8_t digits, bool upper_case)
{
    while (digits > 0) {
        const uint8_t digit = value >> 4 * --digits & 0xF;
        const char ten = upper_case ? 'A' : 'a';
        writer_character((char)(digit < 10 ? '0' + digit : ten + digit - 10));
    }
}

void writer_begin(const FLASH char *kind)
{
    length = 0;
    overflow = false;
    writer_text(kind);
    writer_character(' ');
    write_digits(sequence++, 1);
}

void writer_key(const FLASH char *key)
{
    writer_character(' ');
    writer_text(key);
    writer_character('=');
}

void writer_word(const FLASH char *key, const FLASH char *value)
{
    writer_key(key);
    writer_text(value);
}

void writer_unsigned(const FLASH char *key, uint32_t value)
{
    writer_key(key);
    write_digits(value, 1);
}

void writer_signed(const FLASH char *key, int32_t value)
{
    writer_key(key);
    if (value < 0) {
        writer_character('-');
    }
    write_digits(value < 0 ? 0U - (uint32_t)value : (uint32_t)value, 1);
}

void writer_decimal(const FLASH char *key, uint32_t value, uint8_t decimals)
{
    uint32_t unit = 1;
    for (uint8_t i = 0; i < decimals; i++) {
        unit *= 10;
    }
    writer_key(key);
    write_digits(value / unit, 1);
    writer_character('.');
    write_digits(value % unit, decimals);
}

// The ending has its room: writer_character leaves it.
static bool send(void)
{
    line[length++] = '\n';
    return !overflow && hal_write(line, length);
}

bool writer_end(void)
{
    static const FLASH char hexadecimal[] = "0123456789ABCDEF";
    const uint16_t crc = crc16(line, length);
    line[length++] = '*';
    for (uint8_t shift = 16; shift > 0; shift -= 4) {
        line[length++] = hexadecimal[crc >> (shift - 4) & 0xF];
    }
    return send();
}

void writer_remark(void)
{
    length = 0;
    overflow = false;
    writer_text(TEXT("# "));
}

bool writer_end_remark(void)
{
    return send();
}
