"""Numbers that float32 cannot hold exactly, by name; a portable function takes them as `real(THIRD)`."""

import math

THIRD = 1 / 3
TWO_THIRDS = 2 / 3

QUARTER_PI = math.pi / 4
HALF_PI = math.pi / 2
TAU = math.tau

SQRT_2 = math.sqrt(2.0)
COS_30 = math.sqrt(0.75)
TAN_PI_8 = SQRT_2 - 1.0
