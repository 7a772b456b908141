# SPDX-License-Identifier: BSD-3-Clause
"""Raw points in, unlit, default settings: PSNR against a path tracer's thin lens on the meshes that
the clouds were sampled from, and no blurred view worse than its pinhole view; with seven lens cells
at the widest aperture; and against the mean of many pinhole pictures of the same surfels."""

import os
import sys
import unittest

from measures import psnr
from toolcase import ToolCase

TRUTH = os.environ["TRUTH"]
VIEWS = ("pinhole", "coc4", "coc12", "coc36")  # radius of the circle of confusion at infinity, px

# dB; what was measured less 0.3: a change of more than that is one of the method, not of rounding
# or of the instruction set.
FLOORS = {
    "plane": (38.5, 40.2, 43.5, 46.1),
    "stanford-bunny": (36.5, 38.4, 42.9, 45.4),
    "bars": (36.3, 37.5, 38.0, 37.2),
    "veil": (41.9, 43.4, 47.7, 51.9),
}

CELLS = "7"
CELLS_FLOORS = {"plane": 46.8, "stanford-bunny": 47.2, "bars": 38.6, "veil": 52.6}  # coc36
MANY_CELLS = "19"
# At coc12 against the own reference: one picture, seven cells and many; what was measured less 0.5.
# Seven are drawn only where things cover one another: the rest of a picture is as one is, and the
# plane is all rest. Everywhere they had 60.6, 58.6, 52.7 and 65.6. Many are drawn everywhere. Both
# pictures have sharper textures since the surfels' colours interpolate those of the points and since
# kernels are narrow across edges. So the same error of the lens, in edges that are blurred by it, has
# 0.7 and then up to 2.8 dB less (the bunny's wall); against the ray tracer, which is 10 dB farther
# away, one picture gained 1.7 dB.
POINTS = "200"
OWN_FLOORS = {"plane": (52.4, 53.2, 66.9), "stanford-bunny": (51.7, 52.6, 59.4),
              "bars": (44.7, 49.3, 56.5), "veil": (59.4, 60.6, 68.8)}


class Truth(ToolCase):
    def picture(self, cloud, scene, view, *options):
        self.render(cloud, "--camera", f"{TRUTH}/{scene}.json:{view}", "--unlit", "-o", "out.exr",
                    *options)
        return self.read_rgba("out.exr")[..., :3]

    def psnr(self, cloud, scene, view, *options):
        return psnr(self.picture(cloud, scene, view, *options),
                    self.read_rgba(f"{TRUTH}/{scene}-{view}.exr")[..., :3])

    def check_cells(self, nodes, scene):
        value = self.psnr(nodes, scene, "coc36", "--lens-cells", CELLS)
        print(scene, f"coc36, K = {CELLS}: {value:.2f}")
        self.assertGreater(value, CELLS_FLOORS[scene], scene)

    def check_own(self, nodes, scene):
        reference = self.picture(nodes, scene, "coc12", "--reference", POINTS)
        reached = [psnr(self.picture(nodes, scene, "coc12", *options), reference)
                   for options in ((), ("--lens-cells", CELLS), ("--lens-cells", MANY_CELLS))]
        print(scene, "coc12, own reference:", *(f"{value:.2f}" for value in reached))
        for value, floor in zip(reached, OWN_FLOORS[scene]):
            self.assertGreater(value, floor, scene)

    def test_scenes(self):
        for scene, floors in FLOORS.items():
            # The first view estimates the surfels, the others draw them as they were written.
            reached = [self.psnr(f"{TRUTH}/{scene}.ply", scene, VIEWS[0], "--hierarchy", "n.vtp")]
            reached += [self.psnr("n.vtp", scene, view) for view in VIEWS[1:]]
            print(scene, *(f"{view} {value:.2f}" for view, value in zip(VIEWS, reached)))
            for view, value, floor in zip(VIEWS, reached, floors):
                self.assertGreater(value, floor, (scene, view))
                self.assertGreaterEqual(value, reached[0], (scene, view))
            self.check_cells("n.vtp", scene)
            self.check_own("n.vtp", scene)


if __name__ == "__main__":
    if not all(os.path.exists(f"{TRUTH}/{scene}.json") for scene in FLOORS):
        print(f"skipped: no ray-traced scenes in {TRUTH} (SURFELSPLATTING_TRUTH_DIR)")
        sys.exit(77)
    unittest.main()
