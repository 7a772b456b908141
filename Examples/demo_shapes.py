# SPDX-License-Identifier: BSD-3-Clause
"""Closed shapes as evenly sampled points with exact normals, for demo_scene.py."""

from dataclasses import dataclass
from typing import Optional

import numpy as np

GOLDEN = (np.sqrt(5) - 1) / 2
SECTION = 0.5  # of a blade: thickness over width
# Roberts' R2 sequence: 1/p and 1/p^2, p the real root of p^3 = p + 1.
R2 = np.array([0.7548776662466927, 0.5698402909980532])


@dataclass
class Cloud:
    points: np.ndarray  # [n, 3]
    normals: np.ndarray  # [n, 3], outward, length 1
    colors: Optional[np.ndarray] = None  # [n, 3], 0 to 1

    def where(self, mask):
        return Cloud(self.points[mask], self.normals[mask],
                     None if self.colors is None else self.colors[mask])

    @staticmethod
    def join(clouds):
        return Cloud(*(np.concatenate([getattr(cloud, name) for cloud in clouds])
                       for name in ("points", "normals", "colors")))

    def write_ply(self, path):
        names = ["x", "y", "z", "nx", "ny", "nz"]
        record = np.empty(len(self.points), [(name, "<f4") for name in names]
                          + [(name, "u1") for name in ("red", "green", "blue")])
        for i in range(3):
            record[names[i]] = self.points[:, i]
            record[names[3 + i]] = self.normals[:, i]
            record[("red", "green", "blue")[i]] = np.clip(self.colors[:, i] * 255 + 0.5, 0, 255)
        header = ["ply", "format binary_little_endian 1.0", f"element vertex {len(record)}"]
        header += [f"property float {name}" for name in names]
        header += [f"property uchar {name}" for name in ("red", "green", "blue")]
        with open(path, "wb") as file:
            file.write(("\n".join(header) + "\nend_header\n").encode())
            record.tofile(file)


def evenly(count, start=0):
    """[n, 2] in the unit square, evenly spread."""
    return ((np.arange(start, start + count)[:, None] + 0.5) * R2) % 1.0


def smoothstep(low, high, x):
    t = np.clip((x - low) / (high - low), 0, 1)
    return t * t * (3 - 2 * t)


_LATTICE = np.random.default_rng(1).uniform(0, 1, (256, 256))


def noise(xy):
    """Smooth value noise, 0 to 1, two octaves; one lattice cell is one unit."""
    def octave(p):
        cell = np.floor(p).astype(int)
        f = p - cell
        f = f * f * (3 - 2 * f)
        a, b = cell[:, 0] % 256, cell[:, 1] % 256
        a1, b1 = (a + 1) % 256, (b + 1) % 256
        left = _LATTICE[a, b] + f[:, 1] * (_LATTICE[a, b1] - _LATTICE[a, b])
        right = _LATTICE[a1, b] + f[:, 1] * (_LATTICE[a1, b1] - _LATTICE[a1, b])
        return left + f[:, 0] * (right - left)

    xy = np.asarray(xy, float)
    return 0.65 * octave(xy) + 0.35 * octave(2.03 * xy + 31.4)


def _unit(vectors):
    return vectors / np.maximum(np.linalg.norm(vectors, axis=-1, keepdims=True), 1e-12)


def lathe(profile, count, ripple=0.0):
    """The profile [m, 2] of (radius, z) turned about z, the outside to the left of its direction.

    -> Cloud, and the position of each point on the profile, 0 to m - 1.
    """
    radius, z = profile.T
    length = np.hypot(np.diff(radius), np.diff(z))
    area = np.concatenate([[0], np.cumsum(length * (radius[1:] + radius[:-1]) / 2)])
    along = np.interp((np.arange(count) + 0.5) / count * area[-1], area, np.arange(len(radius)))
    angle = 2 * np.pi * GOLDEN * np.arange(count)
    r = np.interp(along, np.arange(len(radius)), radius)
    wave = ripple * np.sin(angle * 9) * r
    slope_r = np.interp(along, np.arange(len(radius)), np.gradient(radius))
    slope_z = np.interp(along, np.arange(len(radius)), np.gradient(z))
    points = np.column_stack([r * np.cos(angle), r * np.sin(angle),
                              np.interp(along, np.arange(len(radius)), z) + wave])
    normals = np.column_stack([-slope_z * np.cos(angle), -slope_z * np.sin(angle), slope_r])
    return Cloud(points, _unit(normals)), along


def ellipsoids(rng, centers, size, axes, flatness, bumps, per_item):
    """Balls of radius `size`, scaled by `flatness` along `axes`, with dents of relative depth."""
    n = len(centers)
    k = np.arange(per_item) + 0.5
    z = 1 - 2 * k / per_item
    ring = np.sqrt(1 - z * z)
    ball = np.column_stack([ring * np.cos(k * 2.39996), ring * np.sin(k * 2.39996), z])
    axes = _unit(np.asarray(axes, float))
    side = _unit(np.cross(axes, np.where(np.abs(axes[:, [2]]) < 0.9, [0, 0, 1.0], [1.0, 0, 0])))
    frame = np.stack([side, np.cross(axes, side), axes], axis=1)  # [n, 3 axes, 3]
    # Dents: three waves each, different for each ball; the normals follow to first order.
    wave = rng.normal(0, 2.2, (n, 3, 3))
    phase = rng.uniform(0, 2 * np.pi, (n, 1, 3))
    argument = np.einsum("kj,nij->nki", ball, wave) + phase
    radial = 1 + bumps * np.sin(argument).sum(axis=2, keepdims=True) / 2
    slope = bumps * np.einsum("nki,nij->nkj", np.cos(argument), wave) / 2
    scale = np.array([1, 1, flatness])
    local = ball * radial * scale
    tangent = slope - (slope * ball).sum(axis=2, keepdims=True) * ball
    local_normals = (ball - tangent / radial) / scale
    points = centers[:, None, :] + size[:, None, None] * np.einsum("nkj,njx->nkx", local, frame)
    normals = _unit(np.einsum("nkj,njx->nkx", local_normals, frame))
    return Cloud(points.reshape(-1, 3), normals.reshape(-1, 3))


def blades(rng, feet, tall, width, per_blade, crest=0):
    """Bent, tapering blades of elliptic section, feet [n, 2] on the ground.

    -> Cloud, position along the blade (0 foot, 1 tip)[, `crest` points of each blade's axis from
    its tip down, [n, crest, 3]].
    """
    n = len(feet)
    heading = rng.uniform(0, 2 * np.pi, (n, 1))
    lean = rng.uniform(0.05, 0.75, (n, 1)) ** 1.5 * tall[:, None]
    uv = evenly(per_blade)
    taper = np.linspace(0, 1, 200)
    taper_area = np.cumsum(1.3 - taper ** 2.5)
    s = np.interp(uv[:, 0], taper_area / taper_area[-1], taper)  # even in area
    turn = 2 * np.pi * uv[:, 1]
    slope_along = 2 * lean * s
    slope_up = tall[:, None] * (1 - 0.44 * (lean / tall[:, None]) * s)
    out = np.stack([np.cos(heading), np.sin(heading), 0 * heading], axis=-1)
    across = np.stack([-np.sin(heading), np.cos(heading), 0 * heading], axis=-1)
    up = np.array([0, 0, 1.0])
    direction = _unit(slope_along[..., None] * out + slope_up[..., None] * up)
    front = np.cross(np.broadcast_to(across, direction.shape), direction)
    broad = width * rng.uniform(0.7, 1.3, (n, 1)) * (1.3 - s ** 2.5)
    thin = SECTION * broad
    foot = np.column_stack([feet, ground_height(feet) - 0.02])[:, None, :]

    def axis(s):
        rise = tall[:, None] * s * (1 - 0.22 * (lean / tall[:, None]) * s)
        return foot + (lean * s ** 2)[..., None] * out + rise[..., None] * up

    points = (axis(s) + (broad * np.cos(turn))[..., None] * across
              + (thin * np.sin(turn))[..., None] * front)
    normals = (SECTION * np.cos(turn))[:, None] * across + np.sin(turn)[:, None] * front
    cloud = Cloud(points.reshape(-1, 3), _unit(normals).reshape(-1, 3))
    along = np.tile(s, n)
    if not crest:
        return cloud, along
    return cloud, along, axis(1 - np.arange(crest) * 0.25 / crest)


# --- the ground ---------------------------------------------------------------------------------
def ground_height(xy):
    """Rolling, with humps of moss."""
    xy = np.asarray(xy, float)
    hills = 0.35 * (noise(xy * 0.35 + 3) - 0.5)
    return hills + 0.07 * noise(xy * 2.6) + 0.016 * noise(xy * 13) - 0.12


def ground_sheet(eye, count, near=1.2, far=27.0):
    """The ground before the eye, as dense as it looks: the spacing grows with the distance."""
    uv = evenly(count)
    depth = near * (far / near) ** uv[:, 0]
    x = eye[0] + (2 * uv[:, 1] - 1) * depth * 0.45
    xy = np.column_stack([x, eye[1] + depth])
    step = 1e-3
    dx = (ground_height(xy + [step, 0]) - ground_height(xy - [step, 0])) / (2 * step)
    dy = (ground_height(xy + [0, step]) - ground_height(xy - [0, step])) / (2 * step)
    normals = _unit(np.column_stack([-dx, -dy, np.ones(count)]))
    return Cloud(np.column_stack([xy, ground_height(xy)]), normals)


def wall(distance, width, height, count):
    """Upright at y = distance, facing the viewer."""
    uv = evenly(count)
    points = np.column_stack([(uv[:, 0] - 0.5) * width, np.full(count, distance),
                              uv[:, 1] * height - 1.0])
    return Cloud(points, np.tile([0.0, -1.0, 0.0], (count, 1)))
