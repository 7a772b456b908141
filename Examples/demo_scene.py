#!/usr/bin/python3
# SPDX-License-Identifier: BSD-3-Clause
"""Builds the demo's point cloud: toadstools in a meadow at dusk, about a million points.

    demo_scene.py SCENE.ply CAMERA.json

All things are closed shapes, evenly sampled, with exact normals. The light is part of the colours,
so the picture is rendered unlit. z is up; one unit is the height of a toadstool.
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
    """Light of the sun, the sky above and the ground below; glow lets the sun shine through."""
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


def wart_places(rng, radius, height, count):
    """-> centres on the cap, its normals there, sizes."""
    t = np.sqrt((np.arange(count) + 0.5) / count) * 0.93
    angle = np.arange(count) * 2.39996 + rng.normal(0, 0.25, count)
    t = np.clip(t + rng.normal(0, 0.02, count), 0.02, 0.95) * np.pi / 2
    centers = np.column_stack([radius * np.sin(t) * np.cos(angle),
                               radius * np.sin(t) * np.sin(angle), height * np.cos(t) ** 0.9])
    size = radius * rng.uniform(0.045, 0.095, count) * (1.1 - 0.35 * t)
    return centers, centers / np.array([radius, radius, height]) ** 2, size


def warts(rng, places, radius, height):
    """Flakes on the cap: flattened balls, half inside it; points inside the cap are left out."""
    centers, normals, size = places
    cloud = ellipsoids(rng, centers, size, normals, flatness=0.55, bumps=0.16, per_item=700)
    r = np.minimum(1, np.hypot(cloud.points[:, 0], cloud.points[:, 1]) / radius)
    cloud = cloud.where(cloud.points[:, 2] > height * (1 - r ** 2) ** 0.45 - 0.001)
    albedo = mix([0.84, 0.77, 0.63], [1.0, 0.97, 0.88], noise(cloud.points[:, :2] * 60))
    return shade(cloud, albedo, glow=0.15)


def uncovered(cloud, places):
    """Where the cap shows between its warts."""
    centers, _, size = places
    distance = np.linalg.norm(cloud.points[:, None, :] - centers, axis=2)
    return (distance > 0.8 * size).all(axis=1)


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


def bend(cloud, height, lean):
    """Bends the stem by `lean` at its top; the part above keeps its shape and is tilted."""
    level = np.clip(cloud.points[:, 2], 0, height)
    above = cloud.points[:, 2] - level
    slope = 2 * lean * level / height ** 2
    cos, sin = 1 / np.hypot(1, slope), slope / np.hypot(1, slope)
    x = cloud.points[:, 0].copy()
    cloud.points[:, 0] = lean * (level / height) ** 2 + cos * x + sin * above
    cloud.points[:, 2] = level - sin * x + cos * above
    nx, nz = cloud.normals[:, 0].copy(), cloud.normals[:, 2].copy()
    cloud.normals[:, 0], cloud.normals[:, 2] = cos * nx + sin * nz, cos * nz - sin * nx


def toadstool(rng, x, y, height, radius, tall, lean, is_near):
    share = 1.0 if is_near else 0.15
    lid, gills = cap(radius, tall * radius, int(60000 * share))
    if is_near:
        places = wart_places(rng, radius, tall * radius, 56)
        show = uncovered(lid, places) | gills
        lid, gills = lid.where(show), gills[show]
        parts = [lid, warts(rng, places, radius, tall * radius)]
    else:
        parts = [lid]
    paint_cap(lid, gills, radius)
    for part in parts:
        part.points[:, 2] += height
    parts.append(stem(height * 1.04, radius, int(30000 * share)))
    if is_near:
        parts.append(skirt(height, radius, 14000))
    whole = Cloud.join(parts)
    bend(whole, height, lean)
    whole.points += [x, y, ground_height(np.array([[x, y]]))[0] - 0.03]
    return whole


# --- the meadow ---------------------------------------------------------------------------------
def moss(count):
    cloud = ground_sheet(CAMERA["position"], count)
    p = cloud.points
    tone = noise(p[:, :2] * 2.1) * 0.6 + noise(p[:, :2] * 17) * 0.4
    albedo = mix([0.10, 0.15, 0.03], [0.42, 0.46, 0.10], tone)
    litter = smoothstep(0.60, 0.80, noise(p[:, :2] * 5.3 + 40))
    albedo = mix(albedo, np.tile([0.36, 0.20, 0.09], (len(p), 1)), 0.75 * litter)
    return shade(cloud, albedo, contact_shadow(p))


def grass(rng, where, height, width, per_blade, color, keep_clear=True):
    """Blades at the points `where`, [n, 2]; where the large toadstool stands they are short."""
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
    corner = np.vstack([scatter(15, (-0.66, -0.30), (-2.7, -2.2)),
                        scatter(9, (0.46, 0.72), (-2.7, -2.3))])
    return [
        grass(rng, middle, 0.36, 0.0115, 1000, green),
        grass(rng, behind, 0.40, 0.022, 300, green),
        grass(rng, corner, 0.58, 0.016, 1600, ([0.2, 0.42, 0.06], [0.62, 0.7, 0.16]), False),
    ]


def heads(rng, centers, size, count, color, flatness):
    beads = ellipsoids(rng, centers, np.full(len(centers), size),
                       np.tile([0, 0, 1.0], (len(centers), 1)), flatness, 0.05, count)
    return shade(beads, np.tile(color, (len(beads.points), 1)), glow=0.4)


def seed_stalks(rng):
    """Thin stems near the plane in focus, with seeds like beads."""
    feet = np.array([[-1.32, -0.30], [1.12, 0.1], [-0.98, 0.6], [0.62, 0.75], [-1.3, 1.2]])
    tall = np.array([0.98, 0.86, 1.10, 1.28, 1.2])
    cloud, along, crests = blades(rng, feet, tall, 0.006, 3000, crest=26)
    parts = [shade(cloud, mix([0.22, 0.33, 0.08], [0.62, 0.56, 0.22], along), glow=0.4)]
    k = np.arange(26)
    swing = np.column_stack([np.cos(k * 2.4), np.sin(k * 2.4), 0 * k])
    swing *= 0.012 + 0.0004 * k[:, None]
    for crest in crests:
        parts.append(heads(rng, crest + swing, 0.011, 180, [0.74, 0.50, 0.26], 1.5))
    return parts


def bellflowers(rng):
    """Close to the lens and completely blurred: colour for the corners."""
    feet = np.array([[-0.60, -2.2], [-0.50, -2.45], [0.64, -2.3], [-0.68, -2.0]])
    tall = np.array([0.62, 0.50, 0.56, 0.76])
    cloud, along, crests = blades(rng, feet, tall, 0.006, 2600, crest=1)
    parts = [shade(cloud, mix([0.2, 0.33, 0.08], [0.4, 0.5, 0.2], along), glow=0.4)]
    around = np.array([[0, 0, 0.0], [0.05, 0.01, -0.05], [-0.045, 0, -0.07], [0.02, 0, -0.12]])
    for crest in crests:
        parts.append(heads(rng, crest[0] + around, 0.028, 900, [0.50, 0.36, 0.86], 1.25))
    return parts


def silk(rng, begin, end, sag, drops):
    """A spider's thread with dew on it."""
    t = np.linspace(0, 1, 1400)
    line = np.outer(1 - t, begin) + np.outer(t, end) - np.outer(4 * sag * t * (1 - t), [0, 0, 1])
    turn = np.arange(len(t)) * 2.39996
    out = np.column_stack([0 * t, np.cos(turn), np.sin(turn)])
    thread = Cloud(line + 0.0011 * out, out)
    shade(thread, np.full((len(t), 3), 0.8))
    s = (np.arange(drops) + 0.5) / drops
    places = np.column_stack([np.interp(s, t, line[:, i]) for i in range(3)])
    dew = ellipsoids(rng, places, rng.uniform(0.004, 0.008, drops),
                     np.tile([0, 0, 1.0], (drops, 1)), 1.0, 0.0, 160)
    glint = np.clip(dew.normals @ SUN, 0, 1) ** 6 + 0.8 * np.clip(-dew.normals @ SUN, 0, 1) ** 3
    dew.colors = mix([0.30, 0.36, 0.38], [1.0, 0.98, 0.92], np.clip(glint, 0, 1))
    return [thread, dew]


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
    # As large as their blur, or they would disappear in it.
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
    """Air between the eye and distant things."""
    depth = cloud.points[:, 1] - CAMERA["position"][1]
    share = 0.55 * smoothstep(5.5, 18.0, depth)
    cloud.colors = mix(cloud.colors, np.tile(HAZE_COLOR, (len(share), 1)), share)
    return cloud


def build_scene():
    rng = np.random.default_rng(SEED)
    ground = moss(330_000)
    plants = [*meadow(rng), *seed_stalks(rng), *bellflowers(rng), pebbles(rng, 36)]
    plants += [toadstool(rng, *shape, is_near=number < 3)
               for number, shape in enumerate(TOADSTOOLS)]
    standing = Cloud.join(plants)
    # Points below the ground would shine through it.
    standing = standing.where(standing.points[:, 2] > ground_height(standing.points[:, :2]) - 0.003)
    threads = [*silk(rng, [-0.155, -0.06, 0.83], [-0.52, -0.02, 0.68], 0.05, 19),
               *silk(rng, [-0.15, -0.05, 0.80], [-0.27, 0.0, 0.66], 0.02, 8)]
    parts = [ground, standing, *threads, *forest(rng, 11)]
    return Cloud.join([haze(Cloud.join(parts)), dusk(24_000), fireflies(rng, 90)])


def main(cloud_path, camera_path):
    scene = build_scene()
    scene.write_ply(cloud_path)
    with open(camera_path, "w", encoding="utf-8") as file:
        json.dump({"views": [CAMERA]}, file, indent=1)


if __name__ == "__main__":
    main(*sys.argv[1:3])
