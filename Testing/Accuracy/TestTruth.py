# SPDX-License-Identifier: BSD-3-Clause
"""Raw points in, unlit, default settings: PSNR against a path tracer's thin lens on the meshes that
the clouds were sampled from, and no blurred view worse than its pinhole view."""

import os
import sys
import unittest

import numpy as np
from toolcase import ToolCase

TRUTH = os.environ["TRUTH"]
VIEWS = ("pinhole", "coc4", "coc12", "coc36")  # radius of the circle of confusion at infinity, px

# dB; what was measured less 0.3: a change of more than that is one of the method, not of rounding
# or of the instruction set.
FLOORS = {
    "plane": (35.7, 37.4, 41.1, 41.4),
    "stanford-bunny": (33.8, 35.6, 40.3, 38.7),
    "bars": (33.6, 34.1, 34.1, 34.4),
    "veil": (39.8, 41.2, 46.0, 48.7),
}


class Truth(ToolCase):
    def psnr(self, cloud, scene, view, *options):
        self.render(cloud, "--camera", f"{TRUTH}/{scene}.json:{view}", "--unlit", "-o", "out.exr",
                    *options)
        difference = self.read_rgba("out.exr") - self.read_rgba(f"{TRUTH}/{scene}-{view}.exr")
        return -10 * np.log10(np.mean(difference[..., :3].astype(float) ** 2))

    def test_scenes(self):
        for scene, floors in FLOORS.items():
            # The first view estimates the surfels, the others draw them as they were written.
            reached = [self.psnr(f"{TRUTH}/{scene}.ply", scene, VIEWS[0], "--surfels", "s.vtp")]
            reached += [self.psnr("s.vtp", scene, view) for view in VIEWS[1:]]
            print(scene, *(f"{view} {value:.2f}" for view, value in zip(VIEWS, reached)))
            for view, value, floor in zip(VIEWS, reached, floors):
                self.assertGreater(value, floor, (scene, view))
                self.assertGreaterEqual(value, reached[0], (scene, view))


if __name__ == "__main__":
    if not all(os.path.exists(f"{TRUTH}/{scene}.json") for scene in FLOORS):
        print(f"skipped: no ray-traced scenes in {TRUTH} (SURFELSPLATTING_TRUTH_DIR)")
        sys.exit(77)
    unittest.main()
