# SPDX-License-Identifier: BSD-3-Clause
"""The equations of 3D Gaussian splatting, plainly, in float64: what pictures are compared with.

B. Kerbl, G. Kopanas, T. Leimkuehler, G. Drettakis. 3D Gaussian Splatting for Real-Time Radiance Field
Rendering. SIGGRAPH 2023; the numbers are those of its published implementation.

Coordinates of a camera: x to the right, y down, z along the view direction. Pictures: row 0 at the
top; the middle of the pixel in column i and row j is at (i + 0.5, j + 0.5).
"""

from dataclasses import dataclass, replace

import numpy as np

DILATION = 0.3  # px^2, added to each footprint
MOST = 0.99  # of the opacity of a Gaussian at a pixel
NEGLIGIBLE = 1e-6  # opacity below which a Gaussian is not evaluated

# Limits of the published implementation, for render(): it leaves out opacities below LEAST, and ends
# a ray before its transmittance falls below STOP.
LEAST, STOP = 1 / 255, 1e-4


@dataclass(frozen=True)
class Camera:
    focal: float  # focal length, px
    center: tuple  # (x, y) of the picture where x = y = 0 in the camera, px
    size: tuple  # (width, height), px
    world_to_camera: np.ndarray  # [4, 4], a rigid motion

    @property
    def position(self):
        """[3] in the world"""
        matrix = np.asarray(self.world_to_camera)
        return -matrix[:3, :3].T @ matrix[:3, 3]


def look_at(position, target, up, focal, size):
    """A Camera with its target in the middle of the picture."""
    position = np.asarray(position, float)
    forward = np.asarray(target) - position
    forward /= np.linalg.norm(forward)
    right = np.cross(forward, up)
    right /= np.linalg.norm(right)
    matrix = np.eye(4)
    matrix[:3, :3] = right, np.cross(forward, right), forward
    matrix[:3, 3] = -matrix[:3, :3] @ position
    return Camera(focal, (size[0] / 2, size[1] / 2), tuple(size), matrix)


def harmonics_at(directions, count=16):
    """[n, count] real spherical harmonics at unit directions [n, 3]; count = 1, 4, 9, 16"""
    x, y, z = np.asarray(directions, float).T
    xx, yy, zz = x * x, y * y, z * z
    basis = [0.28209479177387814 + 0 * x]
    if count > 1:
        basis += [-0.4886025119029199 * y, 0.4886025119029199 * z, -0.4886025119029199 * x]
    if count > 4:
        basis += [1.0925484305920792 * x * y, -1.0925484305920792 * y * z,
                  0.31539156525252005 * (2 * zz - xx - yy), -1.0925484305920792 * x * z,
                  0.5462742152960396 * (xx - yy)]
    if count > 9:
        basis += [-0.5900435899266435 * y * (3 * xx - yy), 2.890611442640554 * x * y * z,
                  -0.4570457994644658 * y * (4 * zz - xx - yy),
                  0.3731763325901154 * z * (2 * zz - 3 * xx - 3 * yy),
                  -0.4570457994644658 * x * (4 * zz - xx - yy), 1.445305721320277 * z * (xx - yy),
                  -0.5900435899266435 * x * (xx - 3 * yy)]
    return np.stack(basis, axis=1)


def colors_from(position, gaussians):
    """[n, 3] max(0, 0.5 + harmonics) seen from a position [3] in the world"""
    rays = gaussians.positions - position
    rays = rays / np.linalg.norm(rays, axis=1, keepdims=True)
    basis = harmonics_at(rays, gaussians.harmonics.shape[1])
    return np.maximum(0.0, 0.5 + np.einsum("nk,nkc->nc", basis, gaussians.harmonics))


def footprints(local, covariances, camera):
    """-> centres [n, 2] in px, and W = J V S V' J' + 0.3 I as [n, 2, 2] in px^2.

    local: [n, 3] in the camera, before it. covariances: [n, 3, 3] in the world.
    """
    x, y, z = local.T
    f, zero = camera.focal, 0 * z
    centers = np.stack([f * x / z, f * y / z], axis=1) + camera.center
    jacobians = np.stack([f / z, zero, -f * x / z ** 2, zero, f / z, -f * y / z ** 2],
                         axis=1).reshape(-1, 2, 3)
    m = jacobians @ np.asarray(camera.world_to_camera)[:3, :3]
    return centers, m @ covariances @ m.transpose(0, 2, 1) + DILATION * np.eye(2)


def render(gaussians, camera, near=0.0, least=None, stop=None):
    """-> [height, width, 4] red, green, blue, premultiplied, and 1 - transmittance.

    gaussians: captures.Gaussians. near: Gaussians nearer than this along the view direction are left
    out, world units (0.2 in the published implementation). least, stop: LEAST and STOP, or None for
    the equations without them.
    """
    matrix = np.asarray(camera.world_to_camera)
    local = gaussians.positions @ matrix[:3, :3].T + matrix[:3, 3]
    keep = np.flatnonzero((local[:, 2] > near) & (gaussians.opacities > NEGLIGIBLE))
    order = keep[np.argsort(local[keep, 2], kind="stable")]  # nearest first
    gaussians, local = gaussians[order], local[order]
    centers, w = footprints(local, gaussians.covariances(), camera)
    colors = colors_from(camera.position, gaussians)
    # q < cut where the Gaussian counts; its box has half widths sqrt(cut W_ii).
    cut = 2 * np.log(gaussians.opacities / NEGLIGIBLE)
    reach = np.sqrt(cut[:, None] * w[:, (0, 1), (0, 1)])
    first = np.clip(np.floor(centers - reach), 0, camera.size).astype(int)
    last = np.clip(np.ceil(centers + reach), 0, camera.size).astype(int)
    return _composite(zip(centers, np.linalg.inv(w), gaussians.opacities, colors, first, last),
                      camera.size, least, stop)


def _composite(splats, size, least, stop):
    """Front to back; the transmittance of ended rays is kept in `light`, and `open` is 0 there."""
    width, height = size
    rgb, light, is_open = np.zeros((height, width, 3)), np.ones((height, width)), None
    if stop is not None:
        is_open = np.ones((height, width), bool)
    columns, rows = np.arange(width) + 0.5, np.arange(height) + 0.5
    for center, conic, opacity, color, (left, top), (right, bottom) in splats:
        if left >= right or top >= bottom:
            continue
        box = slice(top, bottom), slice(left, right)
        dx, dy = columns[left:right] - center[0], (rows[top:bottom] - center[1])[:, None]
        q = conic[0, 0] * dx * dx + (2 * conic[0, 1] * dx + conic[1, 1] * dy) * dy
        alpha = np.minimum(MOST, opacity * np.exp(-0.5 * q))
        if least is not None:
            alpha[alpha < least] = 0.0
        if stop is not None:
            is_open[box] &= ~((alpha > 0) & (light[box] * (1 - alpha) < stop))
            alpha *= is_open[box]
        rgb[box] += (light[box] * alpha)[..., None] * color
        light[box] *= 1 - alpha
    return np.dstack([rgb, 1 - light])


def over(picture, background):
    """[height, width, 3]: a picture of render() over a colour"""
    return picture[..., :3] + (1 - picture[..., 3:]) * np.asarray(background)


def aperture_points(count, radius):
    """[count, 2] points evenly spread over the disc of a lens"""
    k = np.arange(count)
    r, angle = radius * np.sqrt((k + 0.5) / count), k * np.pi * (3 - np.sqrt(5))
    return np.stack([r * np.cos(angle), r * np.sin(angle)], axis=1)


def behind(camera, point, focus):
    """The pinhole camera at a point (x, y) of the lens, in world units; its picture is sheared so
    that things at the distance `focus` along the view direction stay where they are."""
    matrix = np.array(camera.world_to_camera, float)
    matrix[:2, 3] -= point
    center = tuple(c + camera.focal * p / focus for c, p in zip(camera.center, point))
    return replace(camera, center=center, world_to_camera=matrix)


def render_lens(gaussians, camera, radius, focus, count, **limits):
    """The mean of render() over `count` points of a lens of this radius in focus at this distance,
    both in world units."""
    total = 0.0
    for point in aperture_points(count, radius):
        total = total + render(gaussians, behind(camera, point, focus), **limits)
    return total / count
