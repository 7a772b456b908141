# SPDX-License-Identifier: BSD-3-Clause
"""Which arrays are colours."""

import numpy as np

from ..vtkarrays import named_array, to_numpy

COLOR_NAMES = ("rgb", "rgba", "color", "colors", "colour", "colours")


def is_colors(array):
    return (array is not None and array.GetDataTypeAsString() == "unsigned char"
            and array.GetNumberOfComponents() in (3, 4))


def hides_intensity(cloud):
    """Whether the points of a Cloud have intensity that differs, and no colours."""
    points = cloud.data.GetPointData()
    intensity = points.GetArray("intensity")
    if cloud.is_drawable or intensity is None or is_colors(points.GetScalars()):
        return False
    low, high = intensity.GetFiniteRange()
    return low < high


def may_be_colors(array):
    """Whether three or four components are colours with 8 or 16 bits or fractions."""
    if array.GetNumberOfComponents() not in (3, 4) or not array.GetNumberOfTuples():
        return False
    ends = [array.GetFiniteRange(i) for i in range(array.GetNumberOfComponents())]
    return min(low for low, _ in ends) >= 0 and max(high for _, high in ends) <= 65535


def color_bytes(array):
    """-> vtkUnsignedCharArray of colours with 8 or 16 bits or fractions, or None"""
    if array is None or is_colors(array):
        return array
    if not may_be_colors(array):
        return None
    values = np.nan_to_num(to_numpy(array), posinf=0, neginf=0).astype(float)
    is_real = array.GetDataTypeAsString() in ("float", "double")
    scale = 255 if is_real and values.max() <= 1 else 1 if values.max() <= 255 else 1 / 257
    name = "RGBA" if array.GetNumberOfComponents() == 4 else "RGB"
    return named_array(name, np.round(values * scale), np.uint8)


def colors_and_intensity(rgb, intensity):
    """{name: values} of a scan: colours of 8 or 16 bits as bytes, and intensity; each may be None. Writers
    that have none leave zeros."""
    arrays = {}
    if rgb is not None and rgb.any():
        arrays["RGB"] = np.round(rgb / (257 if rgb.max() > 255 else 1)).astype(np.uint8)
    if intensity is not None and intensity.any():
        arrays["intensity"] = intensity
    return arrays
