# SPDX-License-Identifier: BSD-3-Clause
"""Deep pictures: what was read of a file, and what must hold of it."""

import numpy as np


def flatten(counts, samples):
    """counts: [height, width]; samples: {channel: [n]}, pixel after pixel, nearest first
    -> [height, width, 4] RGBA, composited front to back"""
    firsts = np.concatenate([[0], np.cumsum(counts.ravel(), dtype=np.int64)])
    through = np.ones(counts.size)
    flat = np.zeros((counts.size, 4))
    for rank in range(int(counts.max(initial=0))):
        pixels = np.flatnonzero(counts.ravel() > rank)
        at = firsts[pixels] + rank
        for c, channel in enumerate("RGBA"):
            flat[pixels, c] += through[pixels] * samples[channel][at]
        through[pixels] *= 1.0 - samples["A"][at]
    return flat.reshape(*counts.shape, 4)


def check_tidy(test, counts, samples):
    """Sorted, no two at one depth, alpha in (0, 1], finite."""
    test.assertTrue(all(np.isfinite(values).all() for values in samples.values()))
    test.assertGreater(samples["A"].min(), 0.0)
    test.assertLessEqual(samples["A"].max(), 1.0)
    pixel = np.repeat(np.arange(counts.size), counts.ravel())
    steps = np.diff(samples["Z"])[np.diff(pixel) == 0]
    test.assertGreater(len(steps), 0)
    test.assertGreater(steps.min(), 0.0)
