# SPDX-License-Identifier: BSD-3-Clause
"""Captures of 3D Gaussian splatting for tests: scenes of Gaussians, and their files."""

import gzip
from dataclasses import dataclass

import numpy as np

from gaussianreference import harmonics_at
from zstdframes import compressed

C0 = 0.5 / np.sqrt(np.pi)  # the harmonic of degree 0
CHUNK = 256  # Gaussians of a compressed .ply file with one range of values
RESTS = (0, 9, 24, 45)  # properties f_rest_i of a .ply file, by degree


@dataclass
class Gaussians:
    positions: np.ndarray  # [n, 3] world units
    scales: np.ndarray  # [n, 3] standard deviations along the axes, world units
    rotations: np.ndarray  # [n, 4] quaternions w x y z of any length but 0: from axes to world
    opacities: np.ndarray  # [n] 0..1
    harmonics: np.ndarray  # [n, K, 3] coefficients of red, green, blue; K = 1, 4, 9, 16

    def __len__(self):
        return len(self.positions)

    def __getitem__(self, chosen):
        return Gaussians(*(values[chosen] for values in vars(self).values()))

    def covariances(self):
        """[n, 3, 3] R diag(scales^2) R', world units squared"""
        axes = matrices_of(self.rotations) * self.scales[:, None, :]
        return axes @ axes.transpose(0, 2, 1)

    def of_degree(self, degree):
        """The same with harmonics up to this degree."""
        return Gaussians(self.positions, self.scales, self.rotations, self.opacities,
                         self.harmonics[:, :(degree + 1) ** 2])


def joined(*parts):
    """Several Gaussians, whose harmonics have one degree, as one."""
    return Gaussians(*(np.concatenate(values) for values in zip(*(vars(p).values()
                                                                  for p in parts))))


def matrices_of(quaternions):
    """[n, 3, 3] rotations of quaternions w x y z, which need not have length 1"""
    w, x, y, z = (quaternions / np.linalg.norm(quaternions, axis=1, keepdims=True)).T
    return np.stack([1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y),
                     2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x),
                     2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
                    axis=-1).reshape(-1, 3, 3)


def rotations_to(directions, turns):
    """[n, 4] quaternions that turn z to the unit directions [n, 3], after turns [n] about z, rad"""
    x, y, z = directions.T
    # Half way from z to the direction; about x where that is opposite.
    half = np.stack([1 + z, -y, x, np.zeros_like(z)], axis=1)
    half[z < -1 + 1e-9] = (0, 1, 0, 0)
    half /= np.linalg.norm(half, axis=1, keepdims=True)
    c, s = np.cos(turns / 2), np.sin(turns / 2)
    w, i, j, _ = half.T
    return np.stack([w * c, i * c + j * s, j * c - i * s, w * s], axis=1)


def lobe(axes, weights):
    """[n, K] coefficients of sum_l weights[l] P_l(direction . axis), by the addition theorem.

    axes: [n, 3] unit length. weights: one for each degree from 0, up to four.
    """
    basis = harmonics_at(axes, len(weights) ** 2)
    factors = [4 * np.pi / (2 * degree + 1) * weight for degree, weight in enumerate(weights)
               for _ in range(2 * degree + 1)]
    return basis * factors


def of_surface(points, normals, colors, radius, seed=1):
    """Flat, anisotropic Gaussians on a surface, as captures have them, with a sheen of degree 3.

    points: [n, 3] world units. normals: [n, 3] unit length. colors: [n, 3] 0..1. radius: standard
    deviation of the longer axis, world units.
    """
    rng = np.random.default_rng(seed)
    count = len(points)
    scales = radius * np.stack([np.ones(count), rng.uniform(0.4, 1.0, count),
                                np.full(count, 0.1)], axis=1)
    light = np.array([0.4, 0.7, 0.6]) / np.linalg.norm([0.4, 0.7, 0.6])
    mirrored = light - 2 * (normals @ light)[:, None] * normals  # the view direction of a mirror
    sheen = lobe(mirrored, (0.05, 0.08, 0.08, 0.06)) * (normals @ light > 0)[:, None]
    harmonics = np.repeat(sheen[:, :, None], 3, axis=2)
    harmonics[:, 0] += (colors - 0.5) / C0
    return Gaussians(points.astype(float), scales,
                     rotations_to(normals, rng.uniform(0, 2 * np.pi, count)),
                     rng.uniform(0.7, 0.999, count), harmonics)


def torus(count, seed=2):
    """Gaussians on a torus about z with radii 1 and 0.4, in two colours."""
    rng = np.random.default_rng(seed)
    around, across = 2 * np.pi * rng.random((2, count))
    normals = np.stack([np.cos(around) * np.cos(across), np.sin(around) * np.cos(across),
                        np.sin(across)], axis=1)
    points = np.stack([np.cos(around), np.sin(around), np.zeros(count)], axis=1) + 0.4 * normals
    is_red = (np.floor(6 * around / np.pi) + np.floor(3 * across / np.pi)) % 2 > 0
    colors = np.where(is_red[:, None], (0.8, 0.25, 0.2), (0.2, 0.45, 0.75))
    area = 4 * np.pi ** 2 * 0.4
    return of_surface(points, normals, colors, np.sqrt(area / count), seed)


def furry_ball(count, seed=3):
    """Hairs, flakes and clouds of a ball of radius 1: overlapping, translucent, of all shapes."""
    rng = np.random.default_rng(seed)

    def directions(number):
        v = rng.normal(size=(number, 3))
        return v / np.linalg.norm(v, axis=1, keepdims=True)

    out = directions(count)
    kind = rng.integers(0, 10, count)  # 0 to 6 hairs, 7 and 8 flakes, 9 clouds
    shape = np.where((kind < 7)[:, None], (0.1, 0.1, 1.0),
                     np.where((kind < 9)[:, None], (1.0, 0.6, 0.02), (1.0, 1.0, 1.0)))
    size = np.where(kind < 7, 0.09, np.where(kind < 9, 0.04, 0.12))
    size *= rng.lognormal(0.0, 0.4, count) * (20000 / count) ** (1 / 3)
    tilted = out + 0.5 * rng.normal(size=(count, 3))
    tilted /= np.linalg.norm(tilted, axis=1, keepdims=True)
    colors = 0.5 + 0.25 * np.sin(3 * out + (0.0, 2.0, 4.0)) + 0.1 * rng.normal(size=(count, 3))
    harmonics = 0.05 * rng.normal(size=(count, 16, 3))
    harmonics[:, 0] = (colors - 0.5) / C0
    opacities = np.where(kind == 9, rng.uniform(0.01, 0.1, count), rng.uniform(0.05, 1.0, count))
    return Gaussians(out * rng.uniform(0.6, 1.0, (count, 1)), size[:, None] * shape,
                     rotations_to(tilted, rng.uniform(0, 2 * np.pi, count))
                     * rng.uniform(0.3, 3.0, (count, 1)), opacities, harmonics)


def trained(count, seed=4, spread=0.9):
    """Bumpy balls and floaters as training leaves them: sizes of several decades, needles, many of low
    opacity. spread: deviation of the logarithm of the sizes"""
    rng = np.random.default_rng(seed)

    def directions(number):
        v = rng.normal(size=(number, 3))
        return v / np.linalg.norm(v, axis=1, keepdims=True)

    def gaussians(points, normals, colors, sizes, most):
        number = len(points)
        needle = rng.random(number) < 0.4
        scales = np.stack([np.ones(number), np.where(needle, rng.uniform(0.05, 0.25, number),
                                                     rng.uniform(0.3, 1.0, number)),
                           rng.uniform(0.02, 0.3, number)], axis=1)
        harmonics = 0.03 * rng.normal(size=(number, 16, 3))
        harmonics[:, 0] = (np.clip(colors, 0.02, 0.98) - 0.5) / C0
        tilted = normals + 0.3 * rng.normal(size=normals.shape)
        tilted /= np.linalg.norm(tilted, axis=1, keepdims=True)
        return Gaussians(points, (sizes * np.exp(spread * rng.normal(size=number)))[:, None] * scales,
                         rotations_to(tilted, rng.uniform(0, 2 * np.pi, number)),
                         most / (1 + np.exp(-rng.normal(-0.5, 1.8, number))), harmonics)

    def ball(number, radius):
        out, waves = directions(number), rng.uniform(3, 8, 2)
        bumps = 0.2 * np.sin(waves[0] * out[:, 0]) * np.sin(waves[1] * out[:, 1])
        places = radius * (1 + bumps + 0.02 * rng.normal(size=number))
        colors = rng.uniform(0.2, 0.8, 3) + 0.25 * np.sin(12 * out + (0.0, 2.0, 4.0))
        return gaussians(rng.uniform(-1, 1, 3) * (1.2, 1.2, 0.8) + out * places[:, None], out, colors,
                         2 * radius / np.sqrt(number), 1.0)

    radii = rng.uniform(0.15, 0.6, 9)
    parts = [ball(int(0.97 * count * share), radius)
             for radius, share in zip(radii, radii ** 2 / (radii ** 2).sum())]
    rest = count - sum(map(len, parts))
    parts.append(gaussians(rng.uniform(-2, 2, (rest, 3)), directions(rest),
                           0.5 + 0.2 * rng.normal(size=(rest, 3)), 0.1, 0.15))
    return joined(*parts)[rng.permutation(count)]


# Files


def ply_columns(gaussians):
    """{property: [n]} of the reference implementation's .ply files"""
    logits = np.log(gaussians.opacities) - np.log1p(-gaussians.opacities)
    rest = [values for channel in gaussians.harmonics[:, 1:].T for values in channel]
    columns = {name: gaussians.positions[:, i] for i, name in enumerate("xyz")}
    columns.update({f"n{name}": np.zeros(len(gaussians)) for name in "xyz"})
    columns.update({f"f_dc_{i}": gaussians.harmonics[:, 0, i] for i in range(3)})
    columns.update({f"f_rest_{i}": values for i, values in enumerate(rest)})
    columns["opacity"] = logits
    columns.update({f"scale_{i}": np.log(gaussians.scales[:, i]) for i in range(3)})
    columns.update({f"rot_{i}": gaussians.rotations[:, i] for i in range(4)})
    return columns


def write_columns(path, columns, form="binary_little_endian", kind="float"):
    """A .ply file of vertices. form: as the header names it. kind: float or double"""
    count = len(next(iter(columns.values())))
    header = ["ply", f"format {form} 1.0", f"element vertex {count}",
              *(f"property {kind} {name}" for name in columns), "end_header", ""]
    order = ">" if "big" in form else "<"
    values = np.stack(list(columns.values()), axis=1).astype(order + {"float": "f4",
                                                                     "double": "f8"}[kind])
    with open(path, "wb") as file:
        file.write("\n".join(header).encode())
        if form == "ascii":
            for row in values:
                file.write((" ".join(map(str, row)) + "\n").encode())
        else:
            file.write(values.tobytes())


def write_ply(path, gaussians, form="binary_little_endian", kind="float"):
    with np.errstate(divide="ignore"):  # an opacity of 1 has an infinite logit
        write_columns(path, ply_columns(gaussians), form, kind)


SPLAT = np.dtype([("position", "<f4", 3), ("scale", "<f4", 3), ("rgba", "u1", 4),
                  ("rotation", "u1", 4)])


def write_splat(path, gaussians):
    """-> what was written, [n] of SPLAT; colours are those of degree 0"""
    record = np.zeros(len(gaussians), SPLAT)
    colors = np.column_stack([0.5 + C0 * gaussians.harmonics[:, 0], gaussians.opacities])
    unit = gaussians.rotations / np.linalg.norm(gaussians.rotations, axis=1, keepdims=True)
    record["position"], record["scale"] = gaussians.positions, gaussians.scales
    record["rgba"] = np.clip(np.rint(255 * colors), 0, 255)
    record["rotation"] = np.clip(np.rint(128 * unit + 128), 0, 255)
    record.tofile(path)
    return record


def mirrored(gaussians, signs):
    """The same in other axes. signs: three of 1 and -1, by which x, y and z are multiplied"""
    signs = np.array(signs, float)
    directions = np.random.default_rng(5).normal(size=(200, 3))
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    count = gaussians.harmonics.shape[1]
    here, there = harmonics_at(directions, count), harmonics_at(directions * signs, count)
    flips = np.sign((here * there).sum(axis=0))  # each harmonic is odd or even in each axis
    x, y, z = signs
    return Gaussians(gaussians.positions * signs, gaussians.scales,
                     gaussians.rotations * (1, y * z, x * z, x * y), gaussians.opacities,
                     gaussians.harmonics * flips[:, None])


def _spz_rotations(rotations, version):
    """-> bytes [n, 3] of version 2 or [n, 4] of those after it, and the quaternions that they stand for"""
    unit = (rotations / np.linalg.norm(rotations, axis=1, keepdims=True))[:, (1, 2, 3, 0)]
    rows = np.arange(len(unit))
    largest = np.full(len(unit), 3) if version == 2 else np.abs(unit).argmax(axis=1)
    unit *= np.where(unit[rows, largest] < 0, -1, 1)[:, None]
    others = np.array([[j for j in range(4) if j != i] for i in range(4)])[largest]
    rest = unit[rows[:, None], others]
    if version == 2:
        stored = np.rint(127.5 * rest + 127.5).clip(0, 255).astype(np.uint8)
        rest = stored / 127.5 - 1
    else:
        sizes = np.rint(511 * np.sqrt(2) * np.abs(rest)).astype(np.uint32)
        bits = sizes | np.where(rest < 0, 512, 0).astype(np.uint32)
        packed = (largest.astype(np.uint32) << 30 | bits[:, 0] << 20 | bits[:, 1] << 10 | bits[:, 2])
        stored = packed.astype("<u4").view(np.uint8).reshape(-1, 4)
        rest = np.sign(rest) * sizes / 511 / np.sqrt(2)
    read = np.empty_like(unit)
    read[rows[:, None], others] = rest
    read[rows, largest] = np.sqrt(np.maximum(0, 1 - (rest ** 2).sum(axis=1)))
    return stored, read[:, (3, 0, 1, 2)]


def zstd_columns(header, columns, extensions=b"", frame=compressed):
    """-> bytes of a .spz file of version 4; header: its first 15 bytes"""
    frames = [(frame(column), len(column)) for column in columns if column]
    table = [size for content, unpacked in frames for size in (len(content), unpacked)]
    return (header + bytes([len(frames)]) + np.array([32 + len(extensions), 0, 0, 0], "<u4").tobytes()
            + extensions + np.array(table, "<u8").tobytes() + b"".join(content for content, _ in frames))


def write_spz(path, gaussians, version=3, bits=12, flags=0, extensions=b"", axes=(1, -1, -1)):
    """A .spz file -> the Gaussians it stands for, in float64.

    bits: fractional bits of the positions. flags: 1 antialiased, 2 extensions, whose bytes follow the
    columns, in version 4 the header. axes: signs from x, y, z of the Gaussians to those of the file."""
    there = mirrored(gaussians, axes)
    places = np.rint(there.positions * 2.0 ** bits).astype("<i4")
    logs = np.rint(16 * (np.log(there.scales) + 10)).clip(0, 255).astype(np.uint8)
    alphas = np.rint(255 * there.opacities).astype(np.uint8)
    colors = np.rint(255 * (0.15 * there.harmonics[:, 0] + 0.5)).clip(0, 255).astype(np.uint8)
    rest = np.rint(128 * there.harmonics[:, 1:] + 128).clip(0, 255).astype(np.uint8)
    stored, rotations = _spz_rotations(there.rotations, version)
    degree = RESTS.index(3 * rest.shape[1])
    header = (b"NGSP" + np.array([version, len(there)], "<u4").tobytes()
              + bytes([degree, bits, flags]))
    columns = [column.tobytes() for column in (places[:, :, None].view(np.uint8)[:, :, :3], alphas,
                                               colors, logs, stored, rest)]
    with open(path, "wb") as file:
        file.write(zstd_columns(header, columns, extensions) if version == 4 else
                   gzip.compress(header + b"\0" + b"".join(columns) + extensions, 1, mtime=0))
    harmonics = np.concatenate([((colors / 255 - 0.5) / 0.15)[:, None], (rest - 128.0) / 128], axis=1)
    return mirrored(Gaussians(places / 2.0 ** bits, np.exp(logs / 16 - 10), rotations, alphas / 255,
                              harmonics), axes)


def _packed_between(values, bits):
    """[n, k] numbers of values [n, k], of as many bits, between the least and the largest of each
    chunk -> numbers, [chunks, 2 k] least and largest as floats, and the values they stand for"""
    starts = np.arange(0, len(values), CHUNK)
    least, most = (ufunc.reduceat(values, starts).astype(np.float32).astype(float)
                   for ufunc in (np.minimum, np.maximum))
    of = np.arange(len(values)) // CHUNK
    levels = 2.0 ** np.array(bits) - 1
    numbers = np.rint(levels * (values - least[of])
                      / np.maximum(most - least, 1e-30)[of]).clip(0, levels)
    return (numbers.astype(np.uint32), np.hstack([least, most]),
            least[of] + numbers / levels * (most - least)[of])


def _packed_rotations(rotations):
    """-> [n] numbers, and the quaternions w x y z that they stand for"""
    unit = rotations / np.linalg.norm(rotations, axis=1, keepdims=True)
    largest, rows = np.abs(unit).argmax(axis=1), np.arange(len(unit))
    unit *= np.sign(unit[rows, largest])[:, None]
    others = np.array([[j for j in range(4) if j != i] for i in range(4)])[largest]
    numbers = np.rint(1023 * (unit[rows[:, None], others] / np.sqrt(2) + 0.5)).astype(np.uint32)
    read = np.zeros_like(unit)
    read[rows[:, None], others] = np.sqrt(2) * (numbers / 1023 - 0.5)
    read[rows, largest] = np.sqrt(1 - (read ** 2).sum(axis=1))
    packed = largest.astype(np.uint32) << 30
    return packed | numbers[:, 0] << 20 | numbers[:, 1] << 10 | numbers[:, 2], read


def write_packed(path, gaussians, has_colors=True):
    """A compressed .ply file -> the Gaussians it stands for, in float64.

    has_colors: whether chunks have ranges of colours; without them these are from 0 to 1."""
    position, position_range, positions = _packed_between(gaussians.positions, (11, 10, 11))
    scale, scale_range, logs = _packed_between(np.log(gaussians.scales), (11, 10, 11))
    rotation, rotations = _packed_rotations(gaussians.rotations)
    color, color_range, colors = _packed_between(0.5 + C0 * gaussians.harmonics[:, 0], (8, 8, 8))
    if not has_colors:
        color = np.rint(255 * (0.5 + C0 * gaussians.harmonics[:, 0])).clip(0, 255).astype(np.uint32)
        colors = color / 255
    alpha = np.rint(255 * gaussians.opacities).astype(np.uint32)
    vertices = np.stack([position[:, 0] << 21 | position[:, 1] << 11 | position[:, 2], rotation,
                         scale[:, 0] << 21 | scale[:, 1] << 11 | scale[:, 2],
                         color[:, 0] << 24 | color[:, 1] << 16 | color[:, 2] << 8 | alpha], axis=1)
    rest = np.rint((gaussians.harmonics[:, 1:] + 4) * 255 / 8).clip(0, 255).astype(np.uint8)
    chunks = np.hstack([position_range, scale_range] + [color_range] * has_colors)
    ends = [f"{end}_{axis}" for kind in ("x y z", "scale_x scale_y scale_z", "r g b")
            for end in ("min", "max") for axis in kind.split()][:chunks.shape[1]]
    header = ["ply", "format binary_little_endian 1.0", f"element chunk {len(chunks)}",
              *(f"property float {name}" for name in ends), f"element vertex {len(vertices)}",
              *(f"property uint packed_{name}" for name in "position rotation scale color".split())]
    if rest.size:
        header += [f"element sh {len(rest)}",
                   *(f"property uchar f_rest_{i}" for i in range(3 * rest.shape[1]))]
    with open(path, "wb") as file:
        file.write("\n".join([*header, "end_header", ""]).encode())
        file.write(chunks.astype("<f4").tobytes() + vertices.astype("<u4").tobytes())
        file.write(rest.transpose(0, 2, 1).tobytes())
    harmonics = np.concatenate([((colors - 0.5) / C0)[:, None], rest * (8 / 255) - 4], axis=1)
    return Gaussians(positions, np.exp(logs), rotations, alpha / 255, harmonics)


def read_surface(path):
    """-> points, normals, colours 0..1 of a .ply file as scans have: little-endian vertices with
    floats and bytes, x y z nx ny nz red green blue among them"""
    types = {"float": "<f4", "double": "<f8", "uchar": "u1"}
    with open(path, "rb") as file:
        fields, count = [], 0
        for line in iter(file.readline, b"end_header\n"):
            words = line.decode().split()
            if words[0] == "element":
                count = int(words[2])
            elif words[0] == "property":
                fields.append((words[2], types[words[1]]))
        record = np.fromfile(file, np.dtype(fields), count)

    def columns(*names):
        return np.stack([record[name] for name in names], axis=1).astype(float)

    return (columns("x", "y", "z"), columns("nx", "ny", "nz"),
            columns("red", "green", "blue") / 255)
