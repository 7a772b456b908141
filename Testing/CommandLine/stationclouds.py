# SPDX-License-Identifier: BSD-3-Clause
"""Scans of a scene from several places by ray casting. z is up, the unit is a metre."""

import numpy as np

NEAREST = 1e-6


class Scene:
    """Rectangles, boxes and tunnels, of which a scanner sees what is nearest."""

    def __init__(self):
        self._shapes = []  # functions from place, rays [n, 3] to distances [n], normals [n, 3]

    def rectangle(self, corner, u, v):
        corner, u, v = (np.array(x, float) for x in (corner, u, v))
        normal = np.cross(u, v)
        normal /= np.linalg.norm(normal)

        def hit(place, rays):
            with np.errstate(all="ignore"):
                t = (corner - place) @ normal / (rays @ normal)
                at = place + t[:, None] * rays - corner
                inside = [(at @ side >= 0) & (at @ side <= side @ side) for side in (u, v)]
            t = np.where(inside[0] & inside[1] & (t > NEAREST), t, np.inf)
            return t, np.broadcast_to(normal, rays.shape)

        self._shapes.append(hit)
        return self

    def box(self, low, high, without=()):
        """without: names of sides such as "-z", of a room that has another ceiling"""
        low, high = np.array(low, float), np.array(high, float)
        for axis in range(3):
            u, v = np.zeros(3), np.zeros(3)
            u[axis - 2], v[axis - 1] = (high - low)[axis - 2], (high - low)[axis - 1]
            for name, end in (("-", low), ("+", high)):
                if name + "xyz"[axis] not in without:
                    corner = low.copy()
                    corner[axis] = end[axis]
                    self.rectangle(corner, u, v)
        return self

    def tunnel(self, radius, length, height=0.0):
        """A cylinder along x whose axis is at a height, above z = 0"""
        def hit(place, rays):
            y, z = place[1], place[2] - height
            a = rays[:, 1] ** 2 + rays[:, 2] ** 2
            b = y * rays[:, 1] + z * rays[:, 2]
            with np.errstate(all="ignore"):
                root = np.sqrt(b * b - a * (y * y + z * z - radius * radius))
                best = np.full(len(rays), np.inf)
                for t in ((-b - root) / a, (-b + root) / a):
                    at = place + t[:, None] * rays
                    good = ((t > NEAREST) & (at[:, 2] >= 0) & (at[:, 0] >= 0) & (at[:, 0] <= length)
                            & (t < best))
                    best = np.where(good, t, best)
                at = place + np.where(np.isfinite(best), best, 0)[:, None] * rays
                normals = (at - (0, 0, height)) / radius * (0, 1, 1)
            return best, normals

        self._shapes.append(hit)
        return self

    def scan(self, place, step=0.6, noise=0.002, seed=1):
        """-> [n, 3] points, and unit normals of the sides that the scanner has seen. step: degrees"""
        place, random = np.array(place, float), np.random.default_rng(seed)
        azimuth, elevation = np.meshgrid(np.radians(np.arange(0, 360, step)),
                                         np.radians(np.arange(-65, 90, step)))
        rays = np.stack([np.cos(elevation) * np.cos(azimuth), np.cos(elevation) * np.sin(azimuth),
                         np.sin(elevation)], axis=-1).reshape(-1, 3)
        best, normals = np.full(len(rays), np.inf), np.zeros(rays.shape)
        for hit in self._shapes:
            t, own = hit(place, rays)
            normals = np.where((t < best)[:, None], own, normals)
            best = np.minimum(best, t)
        seen = np.isfinite(best)
        rays, best, normals = rays[seen], best[seen], normals[seen]
        best = best + noise * random.normal(size=len(best))
        away = np.einsum("ni,ni->n", rays, normals) > 0
        return place + best[:, None] * rays, np.where(away[:, None], -normals, normals)


def attic():
    """-> Scene of a room under a sloping roof with a cupboard, a table and a thin screen; places"""
    scene = Scene().rectangle((0, 0, 0), (6, 0, 0), (0, 4, 0))
    scene.rectangle((0, 0, 0), (0, 4, 0), (0, 0, 1)).rectangle((6, 0, 0), (0, 4, 0), (0, 0, 3.5))
    for y in (0, 4):
        scene.rectangle((0, y, 0), (6, 0, 0), (0, 0, 1))
        for x in np.arange(0, 6, 0.1):  # a gable, in strips
            scene.rectangle((x, y, 1), (0.1, 0, 0), (0, 0, (x + 0.05) * 2.5 / 6))
    scene.rectangle((0, 0, 1), (0, 4, 0), (6, 0, 2.5))
    scene.box((5.3, 0, 0), (6, 1.2, 2), without=("+x", "-y", "-z"))
    scene.box((2, 2.6, 0.7), (3.2, 3.4, 0.75))
    scene.box((3.5, 1, 0), (3.52, 2.2, 1.6), without=("-z",))
    return scene, [(2.5, 1, 1.4), (4.8, 2.9, 1.6)]


def tunnel():
    """-> Scene of a vaulted tunnel that is open at both ends, with cabinets; places"""
    scene = Scene().rectangle((0, -3, 0), (30, 0, 0), (0, 6, 0)).tunnel(3.0, 30.0)
    for x in (6, 21):
        scene.box((x, 1.9, 0), (x + 0.8, 2.3, 1.5), without=("-z",))
    return scene, [(4, -0.5, 1.6), (15, 0.5, 1.6), (26, -0.5, 1.6)]


def project(scene, places, **options):
    """-> [n, 3] points, normals of the sides that were seen, and places of the scanners; [n] numbers
    of the scans"""
    scans = [scene.scan(place, seed=seed, **options) for seed, place in enumerate(places)]
    numbers = np.repeat(np.arange(len(scans)), [len(points) for points, _ in scans])
    points, normals = (np.concatenate(parts) for parts in zip(*scans))
    return points, normals, np.array(places, float)[numbers], numbers
