# SPDX-License-Identifier: BSD-3-Clause
"""Deep pictures: some to write, what was read of a file, and what must hold of it."""

import numpy as np
from vtkmodules.vtkCommonDataModel import vtkImageData
from vtkmodules.vtkRenderingCore import vtkCamera

from surfelsplatting import vtkSurfelEstimation, vtkSurfelImageRenderer
from surfelsplatting.clouds.polydata import polydata_of
from surfelsplatting.vtkarrays import named_array


def sphere_renderer(points):
    """Points of a sphere about the origin through a lens, with deep samples."""
    estimation = vtkSurfelEstimation()
    estimation.SetInputData(polydata_of(points, {}))
    camera = vtkCamera()
    camera.SetPosition(0, 0, 5)
    camera.SetFocalPoint(0, 0, 0)
    camera.SetFocalDistance(4.2)
    camera.SetFocalDisk(0.3)
    renderer = vtkSurfelImageRenderer()
    renderer.SetInputConnection(estimation.GetOutputPort())
    renderer.SetCamera(camera)
    renderer.SetSize(60, 45)
    renderer.GetSplatter().SetLensCells(4)
    renderer.GetSplatter().DeepSamplesOn()
    return renderer


def deep_image(counts, samples):
    """counts: [height, width], top row first; samples: [n, 5] from the lowest row up."""
    image = vtkImageData()
    image.SetDimensions(counts.shape[1], counts.shape[0], 1)
    image.GetPointData().AddArray(named_array("SampleCount", counts[::-1].ravel(), np.uint32))
    image.GetFieldData().AddArray(
        named_array("DeepSamples", np.reshape(samples, (-1, 5)), np.float32))
    return image


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


def through(samples, depths):
    """What of the light passes the samples {channel: [n]} of a pixel up to these depths. In a sample
    with an extent its logarithm falls evenly."""
    extent = np.maximum(samples["ZBack"] - samples["Z"], 1e-12)
    share = np.clip((np.asarray(depths)[:, None] - samples["Z"]) / extent, 0, 1)
    return np.prod((1.0 - samples["A"].astype(float)) ** share, axis=1)


def check_tidy(test, counts, samples):
    """Sorted, no two at one depth, none in the extent of another, alpha in (0, 1], finite."""
    test.assertTrue(all(np.isfinite(values).all() for values in samples.values()))
    test.assertGreater(samples["A"].min(), 0.0)
    test.assertLessEqual(samples["A"].max(), 1.0)
    pixel = np.repeat(np.arange(counts.size), counts.ravel())
    steps = np.diff(samples["Z"])[np.diff(pixel) == 0]
    test.assertGreater(len(steps), 0)
    test.assertGreater(steps.min(), 0.0)
    if "ZBack" in samples:
        gaps = (samples["Z"][1:] - samples["ZBack"][:-1])[np.diff(pixel) == 0]
        test.assertGreaterEqual(gaps.min(), 0.0)
        test.assertGreaterEqual((samples["ZBack"] - samples["Z"]).min(), 0.0)
