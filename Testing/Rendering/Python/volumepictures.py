# SPDX-License-Identifier: BSD-3-Clause
"""Independent pictures of volumes and of Gaussians in space, in numpy, to compare with, and how
volumes become Gaussians.

A picture is an array [size, size, 4] of red, green, blue, premultiplied, and alpha; row 0 is at the
bottom. Cameras are those of vtkCamera in perspective, square.
"""
import numpy as np
from vtkmodules.util.numpy_support import vtk_to_numpy
from vtkmodules.vtkCommonDataModel import vtkPiecewiseFunction
from vtkmodules.vtkRenderingCore import vtkColorTransferFunction, vtkVolumeProperty

from surfelsplatting import vtkVolumeSplatting


def make_property(opacities, colors, unit_distance=1):
    """opacities: [(scalar, opacity)]. colors: [(scalar, red, green, blue)]"""
    opacity, color, prop = vtkPiecewiseFunction(), vtkColorTransferFunction(), vtkVolumeProperty()
    for point in opacities:
        opacity.AddPoint(*point)
    for point in colors:
        color.AddRGBPoint(*point)
    prop.SetScalarOpacity(opacity)
    prop.SetColor(color)
    prop.SetScalarOpacityUnitDistance(unit_distance)
    return prop


def splat(image, prop, subdivision=1):
    splatting = vtkVolumeSplatting()
    splatting.SetInputData(image)
    splatting.SetVolumeProperty(prop)
    splatting.SetSubdivision(subdivision)
    splatting.Update()
    return splatting.GetOutput()


class View:
    """Position, axes (right, up, view direction) and focal length in px of a vtkCamera."""

    def __init__(self, camera, size):
        unit = lambda a: a / np.linalg.norm(a)
        self.size = size
        self.position = np.array(camera.GetPosition())
        self.ahead = unit(np.array(camera.GetFocalPoint()) - self.position)
        self.right = unit(np.cross(self.ahead, camera.GetViewUp()))
        self.up = np.cross(self.right, self.ahead)
        self.focal_length = size / 2 / np.tan(np.radians(camera.GetViewAngle() / 2))
        self.in_focus = camera.GetFocalDistance() or camera.GetDistance()
        self.lens_radius = camera.GetFocalDisk() / 2

    def rays(self, lens_point):
        """Origin [3] and unit directions [size * size, 3] through a point of the lens, in its radii;
        all rays of a pixel meet in the plane in focus."""
        x = (np.arange(self.size) + 0.5 - self.size / 2) / self.focal_length
        y, x = (a.reshape(-1, 1) for a in np.meshgrid(x, x, indexing="ij"))
        offset = self.lens_radius * (lens_point[0] * self.right + lens_point[1] * self.up)
        direction = self.in_focus * (self.ahead + x * self.right + y * self.up) - offset
        return self.position + offset, direction / np.linalg.norm(direction, axis=1)[:, None]


class Volume:
    """An unturned vtkImageData with the transfer functions of a vtkVolumeProperty."""

    def __init__(self, image, prop, steps=8192):
        scalars = image.GetPointData().GetScalars()
        self.scalars = vtk_to_numpy(scalars).reshape(image.GetDimensions()[::-1]).astype(float)
        self.spacing = np.array(image.GetSpacing())
        self.low = np.array(image.GetBounds()[::2])
        self.high = np.array(image.GetBounds()[1::2])
        self.nodes = np.linspace(self.scalars.min(), self.scalars.max(), steps)
        opacity = np.array([prop.GetScalarOpacity().GetValue(s) for s in self.nodes])
        self.extinction = (-np.log1p(-np.minimum(opacity, 1 - 2.0**-16))
                           / prop.GetScalarOpacityUnitDistance())
        self.color = np.array([prop.GetRGBTransferFunction().GetColor(s) for s in self.nodes])

    def scalar(self, x):
        """Trilinear interpolation at x [n, 3], inside."""
        x = (x - self.low) / self.spacing
        i = np.clip(x.astype(int), 0, np.array(self.scalars.shape[::-1]) - 2)
        f = x - i
        value = 0.0
        for corner in np.ndindex(2, 2, 2):
            weight = np.prod(np.where(corner, f, 1 - f), axis=1)
            value = value + weight * self.scalars[tuple((i + corner).T[::-1])]
        return value

    def march(self, origin, directions, step):
        """Rays [n, 3] to [n, 4]: scalars are interpolated, then classified."""
        with np.errstate(divide="ignore"):
            bounds = np.sort([(self.low - origin) / directions, (self.high - origin) / directions], axis=0)
        begin, end = np.maximum(bounds[0].max(axis=1), 0), bounds[1].min(axis=1)
        picture = np.zeros((len(directions), 4))
        for k in range(int(np.ceil(np.max(end - begin, initial=0) / step))):
            near = begin + k * step
            hit = np.flatnonzero((near < end) & (picture[:, 3] < 0.9999))
            length = np.minimum(step, end - near)[hit]
            s = self.scalar(origin + (near[hit] + length / 2)[:, None] * directions[hit])
            alpha = -np.expm1(-length * np.interp(s, self.nodes, self.extinction))
            light = np.column_stack([np.interp(s, self.nodes, c) for c in self.color.T] + [np.ones(len(s))])
            picture[hit] += ((1 - picture[hit, 3]) * alpha)[:, None] * light
        return picture


def volume_picture(volume, view, step, lens_points=1):
    """The mean over points of the lens of what each sees as a pinhole (one: its middle)."""
    picture = 0
    for k in range(lens_points):
        radius, angle = np.sqrt(k / lens_points + 0.5 / lens_points), k * np.pi * (3 - np.sqrt(5))
        point = (radius * np.cos(angle), radius * np.sin(angle)) if lens_points > 1 else (0, 0)
        picture = picture + volume.march(*view.rays(point), step) / lens_points
    return picture.reshape(view.size, view.size, 4)


def read_gaussians(data):
    """Centres [n, 3], covariances [n, 3, 3], extinctions [n], colours [n, 3] of 0 to 1."""
    arrays = [vtk_to_numpy(data.GetPointData().GetArray(name)).astype(float)
              for name in ("GaussianCovariance", "GaussianExtinction", "RGB")]
    origin = vtk_to_numpy(data.GetFieldData().GetArray("SurfelOrigin")).reshape(3)
    full = arrays[0][:, [0, 3, 5, 3, 1, 4, 5, 4, 2]].reshape(-1, 3, 3)
    return vtk_to_numpy(data.GetPoints().GetData()) + origin, full, arrays[1], arrays[2] / 255


def gaussian_picture(data, view, prefilter=1 / 12):
    """Gaussians in sharp focus, each composited as a whole by the depth of its centre.

    The footprint is the projection's linear part at the centre, widened by the variance of a pixel;
    the optical depth at the centre is the integral along the ray, s sqrt(2 pi / (r' S^-1 r)).
    """
    centers, covariances, extinctions, colors = read_gaussians(data)
    offset = centers - view.position
    z, x, y = (offset @ axis for axis in (view.ahead, view.right, view.up))
    rays = offset / np.linalg.norm(offset, axis=1)[:, None]
    depth = extinctions * np.sqrt(
        2 * np.pi / np.einsum("ni,nij,nj->n", rays, np.linalg.inv(covariances), rays))
    f = view.focal_length
    rows = np.stack([f / z[:, None] * (axis - (a / z)[:, None] * view.ahead)
                     for axis, a in ((view.right, x), (view.up, y))], axis=1)
    footprints = rows @ covariances @ rows.transpose(0, 2, 1)
    wide = footprints + prefilter * np.eye(2)
    depth *= np.sqrt(np.linalg.det(footprints) / np.linalg.det(wide))
    shapes = np.linalg.inv(wide)
    reach = np.sqrt(2 * np.log(np.maximum(depth / 1e-5, 1)))[:, None] * np.sqrt(
        wide[:, (0, 1), (0, 1)])
    middle = np.column_stack([f * x / z, f * y / z]) + view.size / 2
    first = np.maximum(np.ceil(middle - reach - 0.5), 0).astype(int)
    last = np.minimum(np.floor(middle + reach - 0.5), view.size - 1).astype(int)
    picture = np.zeros((view.size, view.size, 4))
    pixels = np.arange(view.size) + 0.5
    for i in np.argsort(z, kind="stable"):
        if depth[i] <= 1e-5 or (first[i] > last[i]).any():
            continue
        block = tuple(slice(first[i, k], last[i, k] + 1) for k in (1, 0))
        u, v = pixels[block[1]] - middle[i, 0], (pixels[block[0]] - middle[i, 1])[:, None]
        (a, b), (_, c) = shapes[i]
        alpha = -np.expm1(-depth[i] * np.exp(-0.5 * (a * u * u + 2 * b * u * v + c * v * v)))
        seen = (1 - picture[block][..., 3]) * alpha
        picture[block] += seen[..., None] * np.append(colors[i], 1)
    return picture


def psnr(first, second):
    """Of the colours over black, dB."""
    return -10 * np.log10(np.mean((first[..., :3] - second[..., :3])**2))
