# SPDX-License-Identifier: BSD-3-Clause
"""Which arrays are colours."""

import numpy as np

from ..vtkarrays import named_array, to_numpy

# In lower case
INTENSITY_NAMES = ("intensity", "i", "scalar_intensity", "reflectance", "reflectivity", "remission", "amplitude",
                   "intensitat", "intensitaet", "intensite", "intensidad", "intensita", "intensidade")
COLOR_NAMES = ("rgb", "rgba", "color", "colors", "colour", "colours")
MOST_OF_BYTES = 511  # above, colours have 16 bits; resampled bytes overshoot by less


def is_colors(array):
    return (array is not None and array.GetDataTypeAsString() == "unsigned char"
            and array.GetNumberOfComponents() in (3, 4))


def intensity_among(names):
    """-> the first name of an intensity, or None"""
    return next((name for name in names if name.lower() in INTENSITY_NAMES), None)


def hidden_intensity(cloud):
    """-> the name of the intensity of a Cloud, if it differs and the points have no colours; or None"""
    points = cloud.data.GetPointData()
    name = intensity_among(points.GetArrayName(i) for i in range(points.GetNumberOfArrays()))
    intensity = points.GetArray(name) if name else None  # None of one of texts
    if cloud.is_drawable or intensity is None or is_colors(points.GetScalars()):
        return None
    low, high = intensity.GetFiniteRange()
    return name if low < high else None


def scale_to_bytes(largest, may_be_fractions=True):
    """The factor from colours to bytes, by the largest value: no scan is as dark as 1 of 255, so that values
    tell more than types, which may be wider."""
    return 255 if may_be_fractions and largest <= 1 else 1 if largest <= MOST_OF_BYTES else 1 / 257


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
    values = np.minimum(np.round(values * scale_to_bytes(values.max(), is_real)), 255)
    return named_array("RGBA" if array.GetNumberOfComponents() == 4 else "RGB", values, np.uint8)


def colors_and_intensity(rgb, intensity):
    """{name: values} of a scan: colours of 8 or 16 bits as bytes, and intensity; each may be None. Writers
    that have none leave zeros."""
    arrays = {}
    if rgb is not None and rgb.any():
        scaled = np.round(rgb * scale_to_bytes(rgb.max(), rgb.dtype.kind == "f"))
        arrays["RGB"] = np.minimum(scaled, 255).astype(np.uint8)
    if intensity is not None and intensity.any():
        arrays["intensity"] = intensity
    return arrays
