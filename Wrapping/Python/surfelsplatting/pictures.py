# SPDX-License-Identifier: BSD-3-Clause
"""Float pictures as 8-bit PNG files."""

from .backend import vtk
from .surfels import update


def _to_srgb(light):
    """sRGB codes of linear light (IEC 61966-2-1)."""
    import numpy as np

    return np.where(light <= 0.0031308, 12.92 * light, 1.055 * np.power(light, 1 / 2.4) - 0.055)


def rgb_bytes(picture, linear_light=False):
    """[n, 3] bytes of the pixels, row 0 is the bottom row; see png_bytes."""
    import numpy as np

    colors = vtk("util.numpy_support").vtk_to_numpy(picture.GetPointData().GetScalars())[:, :3]
    if linear_light:
        colors = _to_srgb(colors)
    return np.ascontiguousarray(np.clip(colors * 255 + 0.5, 0, 255).astype(np.uint8))


def png_bytes(picture, linear_light=False):
    """The contents of a PNG file: 8-bit RGB, 255 times the picture's values.

    picture: vtkImageData with float RGBA scalars, premultiplied; where it is transparent, black
    shows through.
    linear_light: the picture is linear light and is converted to sRGB.
    """
    image = vtk("vtkCommonDataModel").vtkImageData()
    image.SetDimensions(picture.GetDimensions())
    rgb = rgb_bytes(picture, linear_light)
    image.GetPointData().SetScalars(vtk("util.numpy_support").numpy_to_vtk(rgb, deep=True))
    writer = vtk("vtkIOImage").vtkPNGWriter()
    writer.SetInputData(image)
    writer.WriteToMemoryOn()
    writer.Write()
    return memoryview(writer.GetResult())


def write_png(picture, path, linear_light=False):
    """Writes a picture to a .png file; see png_bytes.

    picture: a vtkSurfelImageRenderer, which is updated first, or its output.
    RuntimeError: what the renderer says if it cannot render.
    """
    if not picture.IsA("vtkDataObject"):
        update(picture, "rendering")
        picture = picture.GetOutput()
    content = png_bytes(picture, linear_light)
    with open(path, "wb") as file:
        file.write(content)
