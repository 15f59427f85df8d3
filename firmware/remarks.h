// Copyright 2026 hysteresis_ros contributors
// SPDX-License-Identifier: Apache-2.0
//
// Lines for people at a serial terminal.
#ifndef REMARKS_H
#define REMARKS_H

#include "frame.h"

void remarks_start(uint32_t now);       // and greet
// At most five a second: a broken cable must not flood the host.
void remarks_explain(enum line what, const struct frame *frame, struct text line, uint32_t now);

#endif
