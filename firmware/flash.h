// Copyright 2026 hysteresis_ros contributors
// SPDX-License-Identifier: Apache-2.0
//
// Constant text stays in flash memory on the AVR, whose RAM is small; the compiler knows from the
// type how to read it. Elsewhere there is one memory.
#ifndef FLASH_H
#define FLASH_H

#ifdef __AVR__
#define FLASH __flash
#else
#define FLASH
#endif

// A text in flash memory, inside a function.
#define TEXT(words) (__extension__({ static const FLASH char text_[] = words; &text_[0]; }))

#endif
