// Copyright 2026 hysteresis_ros contributors
// SPDX-License-Identifier: Apache-2.0
//
// Lines to the host: frames with sequence number and CRC, and remarks for people.
//
// A line is written piece by piece and sent as a whole. Where the port has no room for it, it is
// dropped; the host sees that by the gap in the sequence numbers.
#ifndef WRITER_H
#define WRITER_H

#include "text.h"

void writer_start(void);

void writer_begin(const FLASH char *kind);
void writer_word(const FLASH char *key, const FLASH char *value);
void writer_unsigned(const FLASH char *key, uint32_t value);
void writer_signed(const FLASH char *key, int32_t value);
// value / 10^decimals
void writer_decimal(const FLASH char *key, uint32_t value, uint8_t decimals);
void writer_key(const FLASH char *key);     // its value follows by writer_text
bool writer_end(void);

void writer_remark(void);
void writer_text(const FLASH char *text);
void writer_character(char character);
void writer_hexadecimal(uint16_t value, uint8_t digits, bool upper_case);
bool writer_end_remark(void);

#endif
