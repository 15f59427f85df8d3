// Copyright 2026 hysteresis_ros contributors
// SPDX-License-Identifier: Apache-2.0
//
// What the board measures and does, sent once a period.
#ifndef TELEMETRY_H
#define TELEMETRY_H

#include <stdint.h>

void telemetry_start(uint32_t now);
void telemetry_set_period(uint32_t milliseconds, uint32_t now);
void telemetry_send_if_due(uint32_t now);

#endif
