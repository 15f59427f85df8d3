# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
Where an operator keeps what: places in its table of parameters and in its memory.

Both are plain arrays of floats, so that a step hands over two arrays and one number. They begin
alike for every kind of operator; what follows is said in the kind's own file.
"""

# Kinds of operators that are compiled.
PREISACH, PLAY, LINEAR, KINETIC = 0, 1, 2, 3

# In every table: the kind, the ends of the input range, the sign of the output's slope, the lowest
# and the highest output, and the difference of outputs that counts as rounding.
KIND, LOWER, UPPER, SIGN, LOW, HIGH, TOLERANCE = range(7)
TABLE = 7

# In every memory: the present input and output, whether the input was out of range, and the
# direction of the last movement (1 up, -1 down, 0 none).
INPUT, OUTPUT, SATURATED, DIRECTION = range(4)
MEMORY = 4
