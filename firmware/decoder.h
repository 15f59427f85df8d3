// Copyright 2026 hysteresis_ros contributors
// SPDX-License-Identifier: Apache-2.0
//
// Lines out of a stream of bytes, whatever the stream holds. It never keeps more than MAX_LINE.
#ifndef DECODER_H
#define DECODER_H

#include "frame.h"

void decoder_start(void);

// Take a byte. What it returns, and frame and text, are good until the next byte.
enum line decoder_feed(uint8_t byte, struct frame *frame);
struct text decoder_text(void);     // the line, without its newline

#endif
