"""Sine and cosine of many angles at once, for the sweeps over a kinematic tree."""

from __future__ import annotations

import math

from cdtool.base.arrays import FloatArray
from cdtool.base.kernels import kernel
from cdtool.machines.tree_rows import BLOCK, COSINE, OFFSET, ROW, SINE, SLOT

# Adding and subtracting it rounds to an integer: the spacing of the numbers near it is 1.
_ROUND = 6755399441055744.0
# pi in three parts of 33, 33 and 53 bits: an integer below 2^20 times one of the first two is exact.
_PI_1, _PI_2, _PI_3 = 3.1415926534682512, 1.2154201012607932e-10, 4.044532497591901e-21
_REDUCIBLE = 1e6  # rad: below 2^20, see above


@kernel(f"void({ROW}, float64)")
def fill_sine_cosine(pair: FloatArray, slides: float) -> None:
    """Sine and cosine of the angles in the displacement row, to 3e-16; a joint that slides turns by 0.

    q = k pi + r with |r| <= pi/2: sin q = (-1)^k sin r, cos q = (-1)^k cos r, each by its Taylor series.
    """
    if slides != 0.0:
        for j in range(BLOCK):
            pair[SLOT + SINE + j] = 0.0
            pair[SLOT + COSINE + j] = 1.0
        return
    beyond = 0
    for j in range(BLOCK):
        q = pair[SLOT + OFFSET + j]
        beyond += 1 if abs(q) > _REDUCIBLE else 0
        k = (q * 0.3183098861837907 + _ROUND) - _ROUND
        r = ((q - k * _PI_1) - k * _PI_2) - k * _PI_3
        half = 0.5 * k
        sign = 1.0 - 4.0 * abs(half - ((half + _ROUND) - _ROUND))
        z = r * r
        sine = 1.9572941063391263e-20
        sine = sine * z - 8.22063524662433e-18
        sine = sine * z + 2.8114572543455206e-15
        sine = sine * z - 7.647163731819816e-13
        sine = sine * z + 1.6059043836821613e-10
        sine = sine * z - 2.505210838544172e-08
        sine = sine * z + 2.7557319223985893e-06
        sine = sine * z - 0.0001984126984126984
        sine = sine * z + 0.008333333333333333
        sine = sine * z - 0.16666666666666666
        cosine = -8.896791392450574e-22
        cosine = cosine * z + 4.110317623312165e-19
        cosine = cosine * z - 1.5619206968586225e-16
        cosine = cosine * z + 4.779477332387385e-14
        cosine = cosine * z - 1.1470745597729725e-11
        cosine = cosine * z + 2.08767569878681e-09
        cosine = cosine * z - 2.755731922398589e-07
        cosine = cosine * z + 2.48015873015873e-05
        cosine = cosine * z - 0.001388888888888889
        cosine = cosine * z + 0.041666666666666664
        cosine = cosine * z - 0.5
        pair[SLOT + SINE + j] = sign * (r + r * (z * sine))
        pair[SLOT + COSINE + j] = sign * (1.0 + z * cosine)
    if beyond:
        for j in range(BLOCK):
            q = pair[SLOT + OFFSET + j]
            if abs(q) > _REDUCIBLE:
                pair[SLOT + SINE + j] = math.sin(q)
                pair[SLOT + COSINE + j] = math.cos(q)
    for j in range(BLOCK):
        pair[SLOT + OFFSET + j] = 0.0
