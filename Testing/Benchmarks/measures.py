# SPDX-License-Identifier: BSD-3-Clause
"""How far two pictures are apart: arrays, linear, 0 to 1 unless said otherwise."""

import math

import numpy as np

try:
    import flip_evaluator
except ImportError:  # pip install flip-evaluator
    flip_evaluator = None


def psnr(a, b, white=1):
    """dB; 200 at most"""
    error = (np.asarray(a, float) - np.asarray(b, float)) / white
    return -10 * math.log10(max(np.mean(error ** 2), 1e-20))


def flip(picture, reference):
    """Mean FLIP (Andersson et al. 2020) of the pictures as they are shown, 255 times the linear
    value, 67 pixels a degree; None without the flip-evaluator package."""
    if flip_evaluator is None:
        return None
    shown = [np.clip(p, 0, 1).astype(np.float32) for p in (reference, picture)]
    return float(flip_evaluator.evaluate(*shown, "LDR", applyMagma=False)[1])


def errors(picture, reference):
    difference = picture - reference
    return {"rmse": math.sqrt(np.mean(difference ** 2)), "psnr": psnr(picture, reference),
            "max": float(np.abs(difference).max()), "flip": flip(picture, reference)}
