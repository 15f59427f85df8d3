// Copyright 2026 hysteresis_ros contributors
// SPDX-License-Identifier: Apache-2.0
#include "crc16.h"

// One byte at a time without a table: the polynomial has three terms, so eight shifts fold into
// these four exclusive ors.
static uint16_t crc16_next(uint16_t crc, uint8_t byte)
{
    crc = (uint16_t)((crc >> 8) | (crc << 8));
    crc ^= byte;
    crc ^= (uint8_t)((crc & 0xFF) >> 4);
    crc ^= (uint16_t)(crc << 12);
    crc ^= (uint16_t)((crc & 0xFF) << 5);
    return crc;
}

uint16_t crc16(const char *data, uint8_t length)
{
    uint16_t crc = 0xFFFF;
    for (uint8_t i = 0; i < length; i++) {
        crc = crc16_next(crc, (uint8_t)data[i]);
    }
    return crc;
}
