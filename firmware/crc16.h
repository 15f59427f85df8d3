// Copyright 2026 hysteresis_ros contributors
// SPDX-License-Identifier: Apache-2.0
//
// CRC-16/CCITT-FALSE: polynomial 0x1021, start 0xFFFF, nothing reflected or inverted.
#ifndef CRC16_H
#define CRC16_H

#include <stdint.h>

uint16_t crc16(const char *data, uint8_t length);

#endif
