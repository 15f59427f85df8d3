// Copyright 2026 hysteresis_ros contributors
// SPDX-License-Identifier: Apache-2.0
#include "quadrature.h"

const int8_t quadrature_steps[16] = {
    0, -1, 1, MISSED,
    1, 0, MISSED, -1,
    -1, MISSED, 0, 1,
    MISSED, 1, -1, 0,
};
