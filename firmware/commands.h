// Copyright 2026 hysteresis_ros contributors
// SPDX-License-Identifier: Apache-2.0
//
// What the host may ask for, done and answered.
#ifndef COMMANDS_H
#define COMMANDS_H

#include "frame.h"

void commands_obey(const struct frame *frame, uint32_t now);

#endif
