// Copyright 2026 hysteresis_ros contributors
// SPDX-License-Identifier: Apache-2.0
#include "board.h"
#include "hal.h"

int main(void)
{
    hal_start();
    board_start();
    for (;;) {
        board_step();
    }
}
