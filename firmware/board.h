// Copyright 2026 hysteresis_ros contributors
// SPDX-License-Identifier: Apache-2.0
//
// The whole firmware, without the loop around it.
#ifndef BOARD_H
#define BOARD_H

void board_start(void);
void board_step(void);      // one pass of the loop; never waits

#endif
