"""Whether two results are the same but for rounding."""

import numpy as np

# By what a network computes in. Arithmetic in half precision or bfloat16 is beyond fp32's. Sums of whole numbers are
# rounded otherwise by everyone: a level of 255 in each of some layers. A bfloat16 has 8 bits, in each of some layers.
TYPICAL_LIMITS = {"fp32": 1e-4, "int8": 0.01, "bf16": 0.02}


def difference(pairs):
    """Of pairs of arrays, the worst differences as shares of the largest expected magnitude: all but one in a thousand

    values are within `typical`, every value is within `largest`. A value that is rounded to whole pixels may lie on
    either side of a half, so that `typical` judges. Infinite where shapes differ or something is not finite.
    """
    typical = largest = 0.0
    for actual, expected in pairs:
        if actual.shape != expected.shape or not np.isfinite(actual).all():
            return {"typical": float("inf"), "largest": float("inf")}
        off = np.abs(actual - expected).ravel() / max(np.abs(expected).max(), 1e-30)
        typical = max(typical, float(np.quantile(off, 0.999)))
        largest = max(largest, float(off.max()))
    return {"typical": typical, "largest": largest}


def agrees(difference, numbers="fp32"):
    return difference["typical"] <= TYPICAL_LIMITS[numbers]
