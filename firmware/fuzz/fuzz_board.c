// Copyright 2026 hysteresis_ros contributors
// SPDX-License-Identifier: Apache-2.0
//
// What a fuzzer feeds to the firmware on a computer: any bytes, with time between them. It stops
// where a sanitizer does, where a frame is taken whose CRC is wrong, where a duty stands that no
// `set` has asked for, and where one outlives the watchdog.
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "../config.h"
#include "../decoder.h"
#include "../host/host.h"

#define PAUSE 0x01              // this byte lets 64 ms pass; no line may have it
#define MOST 4096

size_t LLVMFuzzerMutate(uint8_t *data, size_t size, size_t most);
size_t LLVMFuzzerCustomMutator(uint8_t *data, size_t size, size_t most, unsigned seed);
int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

// CRC-16/CCITT-FALSE, by a table and apart from the firmware's.
static unsigned crc_of(const uint8_t *data, size_t length)
{
    static unsigned table[256];
    if (!table[1]) {
        for (unsigned byte = 0; byte < 256; byte++) {
            table[byte] = byte << 8;
            for (int bit = 0; bit < 8; bit++) {
                table[byte] = (table[byte] << 1 ^ (table[byte] & 0x8000 ? 0x1021 : 0)) & 0xFFFF;
            }
        }
    }
    unsigned crc = 0xFFFF;
    while (length--) {
        crc = (crc << 8 ^ table[crc >> 8 ^ *data++]) & 0xFFFF;
    }
    return crc;
}

// Four upper-case digits, without a zero at their end.
static void write_crc(char *digits, unsigned crc)
{
    for (int i = 0; i < 4; i++) {
        digits[i] = "0123456789ABCDEF"[crc >> (12 - 4 * i) & 0xF];
    }
}

static void demand(bool holds, const char *what)
{
    if (!holds) {
        fprintf(stderr, "%s\n", what);
        abort();
    }
}

// A line that the decoder takes has a right CRC at its end, and is no longer than allowed.
static void check_frame(void)
{
    struct text line = decoder_text();
    char written[4];
    if (line.length && line.start[line.length - 1] == '\r') {
        line.length--;          // before the newline, and ignored
    }
    demand(line.length >= 5 && line.length < MAX_LINE, "a frame of no possible length");
    const uint8_t *const data = (const uint8_t *)line.start;
    write_crc(written, crc_of(data, line.length - 5U));
    demand(data[line.length - 5] == '*' && !memcmp(data + line.length - 4, written, 4),
           "a frame with a wrong CRC");
}

static void decode(const uint8_t *data, size_t size)
{
    struct frame frame;
    decoder_start();
    for (size_t i = 0; i < size; i++) {
        if (decoder_feed(data[i], &frame) == LINE_FRAME) {
            check_frame();
        }
    }
}

static bool asks_for_heat(const uint8_t *data, size_t size)
{
    for (size_t i = 0; i + 4 <= size; i++) {
        if (!memcmp(data + i, "set ", 4)) {
            return true;
        }
    }
    return false;
}

static void live(const uint8_t *data, size_t size)
{
    static uint8_t answer[65536];
    host_set_supply(12000);
    host_open_stop(false);
    host_start();
    for (size_t i = 0; i < size; i++) {
        if (data[i] == PAUSE) {
            host_advance(64);
        } else {
            host_receive(data + i, 1);
        }
        if (i % 32 == 31) {
            host_step();
        }
    }
    host_advance(20);
    demand(!host_pwm() || asks_for_heat(data, size), "heat without a setpoint");
    host_advance(LONGEST_WATCHDOG + 20);
    demand(!host_pwm(), "a duty that outlives the watchdog");
    host_transmit(answer, sizeof answer);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
#ifdef FUZZ_DECODER
    (void)live;         // takes a thousand times as long
#else
    live(data, size);
#endif
    decode(data, size);
    return 0;
}

// Most changes spoil a CRC, behind which the interesting code begins: some lines get theirs anew.
size_t LLVMFuzzerCustomMutator(uint8_t *data, size_t size, size_t most, unsigned seed)
{
    static uint8_t made[2 * MOST];
    size = LLVMFuzzerMutate(data, size, most);
    if (size > MOST || seed % 4 == 0) {
        return size;
    }
    size_t length = 0, start = 0;
    for (size_t i = 0; i <= size && length + 8 < sizeof made; i++) {
        if (i < size && data[i] != '\n') {
            continue;
        }
        size_t end = i;
        for (size_t j = start; j < i; j++) {
            if (data[j] == '*') {
                end = j;
                break;
            }
        }
        if (length + (end - start) + 8 > sizeof made) {
            break;
        }
        memcpy(made + length, data + start, end - start);
        length += end - start;
        if (end > start) {
            made[length++] = '*';
            write_crc((char *)made + length, crc_of(data + start, end - start));
            length += 4;
        }
        made[length++] = '\n';
        start = i + 1;
    }
    length = length < most ? length : most;
    memcpy(data, made, length);
    return length;
}
