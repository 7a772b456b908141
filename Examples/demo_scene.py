#!/usr/bin/python3
# SPDX-License-Identifier: BSD-3-Clause
"""Builds the demo's point cloud: toadstools in a meadow at dusk, about a million points.

    demo_scene.py SCENE.ply CAMERA.json

Every thing is a closed shape, sampled evenly and with its exact normals; the light is painted
into the colours, so that the picture is rendered unlit. z is up, one unit is a toadstool's height.
"""

import json
import sys

import numpy as np

from demo_shapes import (
    Cloud, blades, ellipsoids, ground_height, ground_sheet, lathe, noise, smoothstep, wall)

SEED = 5
SUN = np.array([-0.80, -0.12, 0.55])  # low on the left, a little in front
SUN = SUN / np.linalg.norm(SUN)
SUN_COLOR = np.array([1.05, 0.86, 0.58])
SKY_COLOR = np.array([0.42, 0.50, 0.58])
BOUNCE_COLOR = np.array([0.34, 0.33, 0.18])
HAZE_COLOR = np.array([0.16, 0.25, 0.27])

CAMERA = {
    "name": "demo",
    "position": [0.10, -4.7, 0.40],
    "focalPoint": [-0.02, 0.0, 0.60],
    "viewUp": [0, 0, 1],
    "viewAngle": 22.0,
    "size": [1280, 800],
    "focalDisk": 0.12,
    "focalDistance": 4.45,
}

# x, y, height of the stem, radius of the cap, its height over its radius, lean along x
TOADSTOOLS = [
    (0.30, 0.02, 0.86, 0.47, 0.55, -0.05),
    (-0.34, 0.16, 0.55, 0.30, 0.72, -0.13),
    (0.83, -0.20, 0.30, 0.17, 0.95, 0.06),
    (-1.55, 2.6, 0.75, 0.42, 0.60, 0.05),
    (1.75, 3.6, 0.95, 0.50, 0.50, -0.04),
    (-0.75, 5.5, 0.8, 0.45, 0.6, 0.02),
]


def shade(cloud, albedo, shadow=1.0, glow=0.0):
    """Sun, sky from above, light off the ground from below; glow lets the sun shine through."""
    facing = cloud.normals @ SUN
    sun = np.clip(facing, 0, None) + glow * np.clip(-facing, 0, None)
    up = 0.5 + 0.5 * cloud.normals[:, 2]
    light = (np.outer(sun * shadow, SUN_COLOR) + np.outer(up, SKY_COLOR)
             + np.outer(1 - up, BOUNCE_COLOR))
    cloud.colors = albedo * light
    return cloud


def mix(a, b, share):
    return np.asarray(a) + np.asarray(share)[:, None] * (np.asarray(b) - np.asarray(a))


def contact_shadow(points):
    """How much sun and sky reach the ground beside the toadstools."""
    light = np.ones(len(points))
    for x, y, height, radius, _, _ in TOADSTOOLS:
        for reach, size, depth in ((0.0, 0.5 * radius, 0.55), (0.75 * height, radius, 0.45)):
            offset = points[:, :2] - [x, y] + reach * SUN[:2] / SUN[2]
            light *= 1 - depth * np.exp(-(offset ** 2).sum(axis=1) / (size * size))
    return light


# --- toadstools ---------------------------------------------------------------------------------
def cap(radius, height, count):
    """-> Cloud of the cap around its rim's centre, and which points are gills."""
    t = np.linspace(0, np.pi / 2, 60)
    top = np.column_stack([radius * np.sin(t), height * np.cos(t) ** 0.9])
    s = np.linspace(0, 1, 40)[1:]
    under = np.column_stack([radius * (1 - 0.94 * s), -0.10 * radius * np.sin(np.pi * s ** 0.6)
                             + 0.10 * radius * s])
    cloud, along = lathe(np.vstack([top, under]), count)
    return cloud, along > 59.5


def paint_cap(cloud, gills, radius):
    angle = np.arctan2(cloud.points[:, 1], cloud.points[:, 0])
    distance = np.hypot(cloud.points[:, 0], cloud.points[:, 1]) / radius
    blotch = noise(cloud.points[:, :2] * 9 / radius * 0.3 + 17)
    red = mix([0.70, 0.055, 0.03], [0.98, 0.26, 0.05], 0.75 * distance ** 3 + 0.35 * blotch - 0.1)
    stripes = 0.5 + 0.5 * np.sin(angle * 84)
    cream = mix([0.44, 0.34, 0.24], [0.96, 0.86, 0.68], stripes)
    albedo = np.where(gills[:, None], cream, red)
    depth = np.where(gills, 0.45 + 0.55 * smoothstep(0.2, 1.0, distance), 1.0)
    shade(cloud, albedo * depth[:, None], glow=0.10)
    # A wet gloss: the sky and the sun mirrored in the cap.
    to_eye = np.array([0.0, -1.0, 0.08])
    half = (SUN + to_eye) / np.linalg.norm(SUN + to_eye)
    shine = np.clip(cloud.normals @ half, 0, 1) ** 40 * ~gills
    edge = (1 - np.abs(cloud.normals @ to_eye)) ** 3 * ~gills
    cloud.colors += np.outer(0.85 * shine, [1, 0.95, 0.85]) + np.outer(0.22 * edge, [0.7, 0.85, 1])
    return cloud


def warts(rng, radius, height, count):
    """Flakes on the cap: flattened balls, half sunk in."""
    t = np.sqrt((np.arange(count) + 0.5) / count) * 0.93
    angle = np.arange(count) * 2.39996 + rng.normal(0, 0.25, count)
    t = np.clip(t + rng.normal(0, 0.02, count), 0.02, 0.95) * np.pi / 2
    centers = np.column_stack([radius * np.sin(t) * np.cos(angle),
                               radius * np.sin(t) * np.sin(angle), height * np.cos(t) ** 0.9])
    normals = centers / np.array([radius, radius, height]) ** 2
    size = radius * rng.uniform(0.045, 0.095, count) * (1.1 - 0.35 * t)
    cloud = ellipsoids(rng, centers, size, normals, flatness=0.55, bumps=0.16, per_item=420)
    albedo = mix([0.80, 0.72, 0.58], [0.98, 0.95, 0.86], noise(cloud.points[:, :2] * 60))
    return shade(cloud, albedo, glow=0.15)


def stem(height, radius, count):
    z = np.linspace(0, 1, 80)
    width = radius * (0.19 + 0.16 * np.exp(-((z - 0.05) / 0.13) ** 2) + 0.03 * (1 - z))
    rings = 1 + 0.07 * np.sin(z * 60) * np.exp(-z * 9)
    profile = np.column_stack([width * rings, z * height])[::-1]
    cloud, _ = lathe(profile, count)
    level = cloud.points[:, 2] / height
    fibre = noise(np.column_stack([np.arctan2(cloud.points[:, 1], cloud.points[:, 0]) * 9,
                                   level * 6 + radius * 50]))
    albedo = mix([0.70, 0.60, 0.44], [0.98, 0.93, 0.80], fibre)
    dark = 0.5 + 0.5 * smoothstep(0.0, 0.22, level) * (1 - 0.75 * smoothstep(0.72, 1.0, level))
    return shade(cloud, albedo * dark[:, None], glow=0.12)


def skirt(height, radius, count):
    """The ring of skin that hangs on the stem."""
    s = np.linspace(0, 1, 30)
    out = radius * (0.21 + 0.27 * s ** 1.3)
    down = 0.74 * height - 0.20 * radius * s ** 0.8
    profile = np.vstack([np.column_stack([out, down]),
                         np.column_stack([out, down - 0.015 * radius])[::-1]])
    cloud, _ = lathe(profile, count, ripple=0.05)
    stripes = 0.5 + 0.5 * np.sin(np.arctan2(cloud.points[:, 1], cloud.points[:, 0]) * 46)
    return shade(cloud, mix([0.78, 0.70, 0.54], [0.97, 0.93, 0.82], stripes), glow=0.35)


def toadstool(rng, x, y, height, radius, tall, lean, share):
    base = np.array([x, y, ground_height(np.array([[x, y]]))[0] - 0.03])
    lid, gills = cap(radius, tall * radius, int(52000 * share))
    parts = [paint_cap(lid, gills, radius)]
    if share > 0.2:
        parts.append(warts(rng, radius, tall * radius, 56))
    for part in parts:
        part.points[:, 2] += height
    parts.append(stem(height * 1.04, radius, int(24000 * share)))
    parts.append(skirt(height, radius, int(12000 * share)))
    whole = Cloud.join(parts)
    bend = whole.points[:, 2] / height
    whole.points[:, 0] += lean * bend ** 2
    whole.points += base
    return whole


# --- the meadow ---------------------------------------------------------------------------------
def moss(count):
    cloud = ground_sheet(CAMERA["position"], count)
    p = cloud.points
    tone = noise(p[:, :2] * 2.1) * 0.6 + noise(p[:, :2] * 17) * 0.4
    albedo = mix([0.10, 0.15, 0.03], [0.42, 0.46, 0.10], tone)
    litter = smoothstep(0.60, 0.80, noise(p[:, :2] * 5.3 + 40))
    albedo = mix(albedo, np.tile([0.36, 0.20, 0.09], (len(p), 1)), 0.75 * litter)
    return shade(cloud, albedo, contact_shadow(p)), contact_shadow(p)


def grass(rng, where, height, width, per_blade, color, keep_clear=True):
    """Blades at the points `where`, [n, 2]; in the hero's place only short ones stand."""
    n = len(where)
    tall = height * rng.uniform(0.55, 1.25, n)
    if keep_clear:
        near = np.exp(-((where - [0.15, -0.3]) ** 2 / [0.75 ** 2, 0.5 ** 2]).sum(axis=1))
        tall *= 1 - 0.6 * near
    cloud, along = blades(rng, where, tall, width, per_blade)
    tint = rng.uniform(0, 1, n).repeat(per_blade)
    albedo = mix(color[0], color[1], tint) * mix([0.35] * 3, [1.15, 1.1, 1.0], along ** 0.8)
    return shade(cloud, albedo, glow=0.55)


def meadow(rng):
    green = ([0.16, 0.36, 0.06], [0.50, 0.62, 0.14])
    def scatter(n, x, y):
        return np.column_stack([rng.uniform(*x, n), rng.uniform(*y, n)])

    middle = scatter(230, (-1.7, 1.7), (-0.7, 0.9))
    behind = scatter(700, (-1, 1), (1.0, 9.0))
    behind[:, 0] *= 1.3 + 0.28 * behind[:, 1]
    corner = np.vstack([scatter(26, (-0.72, -0.34), (-2.9, -2.2)),
                        scatter(16, (0.42, 0.70), (-2.9, -2.3))])
    return [
        grass(rng, middle, 0.36, 0.014, 1000, green),
        grass(rng, behind, 0.40, 0.026, 300, green),
        grass(rng, corner, 0.34, 0.012, 1200, ([0.2, 0.42, 0.06], [0.62, 0.7, 0.16]), False),
    ]


def stalks(rng):
    """Thin flowering stems before and behind the plane in focus, with seeds like beads."""
    feet = np.array([[-0.62, -2.35], [-0.47, -2.6], [0.60, -2.5], [-0.95, -0.35], [1.12, 0.1],
                     [-0.72, 0.5], [0.62, 0.75], [-1.3, 1.2]])
    tall = np.array([0.92, 0.78, 0.80, 0.98, 0.86, 1.10, 1.28, 1.2])
    cloud, along, tips = blades(rng, feet, tall, 0.006, 2600, tips=True)
    parts = [shade(cloud, mix([0.22, 0.33, 0.08], [0.62, 0.56, 0.22], along), glow=0.4)]
    for tip in tips:
        k = np.arange(26)
        level = tip[None, :] - np.outer(k * 0.0095, [0, 0, 1])
        swing = np.column_stack([np.cos(k * 2.4), np.sin(k * 2.4), 0 * k]) * (0.012 + 0.0004 * k[:, None])
        beads = ellipsoids(rng, level + swing, np.full(26, 0.011), np.tile([0, 0, 1.0], (26, 1)),
                           flatness=1.5, bumps=0.05, per_item=150)
        parts.append(shade(beads, np.tile([0.74, 0.50, 0.26], (len(beads.points), 1)), glow=0.4))
    return parts


def pebbles(rng, count):
    where = np.column_stack([rng.uniform(-1.5, 1.5, count), rng.uniform(-1.2, 0.6, count)])
    size = rng.uniform(0.015, 0.06, count)
    centers = np.column_stack([where, ground_height(where) + 0.2 * size])
    cloud = ellipsoids(rng, centers, size, np.tile([0, 0, 1.0], (count, 1)), flatness=0.65,
                       bumps=0.12, per_item=700)
    tone = noise(cloud.points[:, :2] * 45) * 0.6 + 0.4 * rng.uniform(0, 1, count).repeat(700)
    return shade(cloud, mix([0.20, 0.19, 0.18], [0.56, 0.53, 0.48], tone))


def fireflies(rng, count):
    """Small and bright, most of them far behind the plane in focus."""
    y = rng.uniform(2.5, 13, count)
    x = rng.uniform(-1, 1, count) * (0.35 * (y + 4.7))
    z = 0.25 + rng.beta(1.6, 2.2, count) * 0.36 * (y + 4.7)
    # As large as their blur there, or they would drown in it.
    lens = 0.5 * CAMERA["focalDisk"]
    size = rng.uniform(0.5, 1.0, count) * lens * (y + 4.7) * (1 / 4.45 - 1 / (y + 4.7))
    cloud = ellipsoids(rng, np.column_stack([x, y, z]), size, np.tile([0, 0, 1.0], (count, 1)),
                       flatness=1.0, bumps=0.0, per_item=110)
    warm = rng.uniform(0, 1, count).repeat(110)
    cloud.colors = mix([1.0, 0.95, 0.62], [1.0, 0.62, 0.22], warm)
    return cloud


def forest(rng, count):
    """Trunks against the last light."""
    parts = []
    for i in range(count):
        y = rng.uniform(7, 15)
        x = (-1 + 2 * (i + rng.uniform(0.2, 0.8)) / count) * 0.42 * (y + 4.7)
        z = np.linspace(-0.3, 7, 40)
        width = rng.uniform(0.10, 0.30) * (1 + 0.6 * np.exp(-z * 1.8))
        cloud, _ = lathe(np.column_stack([width, z])[::-1], 5000)
        cloud.points[:, :2] += [x, y]
        bark = noise(cloud.points[:, [0, 2]] * [9, 1.2])
        parts.append(shade(cloud, mix([0.10, 0.08, 0.07], [0.30, 0.23, 0.17], bark)))
    return parts


def dusk(count):
    """The far end: a wall that glows low on the left, where the sun is."""
    cloud = wall(distance=22.0, width=24.0, height=14.0, count=count)
    x, z = cloud.points[:, 0] / 12, cloud.points[:, 2] / 14
    sky = mix([0.10, 0.20, 0.25], [0.035, 0.07, 0.11], smoothstep(0.0, 0.5, z))
    glow = np.exp(-((x + 0.45) / 0.38) ** 2 - ((z - 0.10) / 0.17) ** 2)
    leaves = noise(cloud.points[:, [0, 2]] * 0.8) * noise(cloud.points[:, [0, 2]] * 2.3 + 9)
    cloud.colors = sky * (0.55 + 1.1 * leaves[:, None]) + np.outer(glow * (0.35 + leaves),
                                                                   [1.05, 0.68, 0.30])
    return cloud


def haze(cloud):
    """Air between the eye and what is far away."""
    depth = cloud.points[:, 1] - CAMERA["position"][1]
    share = 0.55 * smoothstep(5.5, 18.0, depth)
    cloud.colors = mix(cloud.colors, np.tile(HAZE_COLOR, (len(share), 1)), share)
    return cloud


def build_scene():
    rng = np.random.default_rng(SEED)
    ground, _ = moss(330_000)
    parts = [ground, *meadow(rng), *stalks(rng), pebbles(rng, 36), *forest(rng, 11)]
    for number, toadstool_shape in enumerate(TOADSTOOLS):
        parts.append(toadstool(rng, *toadstool_shape, share=1.0 if number < 3 else 0.15))
    return Cloud.join([haze(Cloud.join(parts)), dusk(24_000), fireflies(rng, 90)])


def main(cloud_path, camera_path):
    scene = build_scene()
    scene.write_ply(cloud_path)
    with open(camera_path, "w", encoding="utf-8") as file:
        json.dump({"views": [CAMERA]}, file, indent=1)
    print(len(scene.points))


if __name__ == "__main__":
    main(*sys.argv[1:3])
