# SPDX-License-Identifier: BSD-3-Clause
"""Testing/Shared/gaussianreference.py, with which pictures of Gaussians are compared, against closed
forms and a renderer without boxes and vectors. Needs numpy only."""

import unittest

import numpy as np

from captures import C0, Gaussians, furry_ball, joined, lobe
from gaussianreference import (DILATION, LEAST, MOST, NEGLIGIBLE, STOP, Camera, aperture_points,
                               behind, colors_from, harmonics_at, look_at, over, render,
                               render_lens)

SIZE = (41, 31)


def ball(position, radius, opacity, color=(0.5, 0.5, 0.5)):
    """One round Gaussian whose colour is the same from everywhere."""
    harmonics = (np.array(color) - 0.5).reshape(1, 1, 3) / C0
    return Gaussians(np.array([position], float), np.full((1, 3), radius),
                     np.array([[1.0, 0, 0, 0]]), np.array([opacity]), harmonics)


def straight(focal=40.0, size=SIZE):
    """At the origin, looking along z."""
    return Camera(focal, (size[0] / 2, size[1] / 2), size, np.eye(4))


def naive(gaussians, camera, least=0.0, stop=0.0):
    """Pixel by pixel, as the paper's algorithm 2 has it, with W from matrices of each Gaussian."""
    width, height = camera.size
    rotation, shift = camera.world_to_camera[:3, :3], camera.world_to_camera[:3, 3]
    splats = []
    for position, s, o, color in zip(gaussians.positions, gaussians.covariances(),
                                     gaussians.opacities, colors_from(camera.position, gaussians)):
        x, y, z = rotation @ position + shift
        if z > 0:
            f = camera.focal
            j = np.array([[f / z, 0, -f * x / z ** 2], [0, f / z, -f * y / z ** 2]])
            w = j @ rotation @ s @ rotation.T @ j.T + DILATION * np.eye(2)
            splats.append((z, f * np.array([x, y]) / z + camera.center, np.linalg.inv(w), o, color))
    splats.sort(key=lambda splat: splat[0])
    picture = np.zeros((height, width, 4))
    for row in range(height):
        for column in range(width):
            rgb, light = np.zeros(3), 1.0
            for _, center, conic, o, color in splats:
                d = np.array([column + 0.5, row + 0.5]) - center
                alpha = min(MOST, o * np.exp(-d @ conic @ d / 2))
                if alpha < least:
                    continue
                if light * (1 - alpha) < stop:
                    break
                rgb += light * alpha * color
                light *= 1 - alpha
            picture[row, column] = *rgb, 1 - light
    return picture


def moments(picture):
    """Mass, mean [2] and covariance [2, 2] of the opacity, px."""
    alpha = picture[..., 3]
    y, x = np.indices(alpha.shape) + 0.5
    mass = alpha.sum()
    mean = np.array([(alpha * x).sum(), (alpha * y).sum()]) / mass
    d = np.stack([x - mean[0], y - mean[1]])
    return mass, mean, np.einsum("ijk,ljk,jk->il", d, d, alpha) / mass


class TestGaussianReference(unittest.TestCase):
    def test_one_on_the_axis(self):
        """opacity exp(-r^2 / 2 v), v = (f s / z)^2 + 0.3; its colour over a background."""
        picture = render(ball((0, 0, 5), 0.5, 0.8, (0.9, 0.4, 0.0)), straight())
        y, x = np.indices(picture.shape[:2]) + 0.5
        r2 = (x - SIZE[0] / 2) ** 2 + (y - SIZE[1] / 2) ** 2
        alpha = 0.8 * np.exp(-r2 / 2 / ((40 * 0.5 / 5) ** 2 + DILATION))
        for channel, factor in enumerate((0.9, 0.4, 0.0, 1.0)):
            np.testing.assert_allclose(picture[..., channel], factor * alpha, atol=NEGLIGIBLE)
        np.testing.assert_allclose(over(picture, (0, 1, 1)), picture[..., :3]
                                   + (1 - alpha[..., None]) * (0, 1, 1), atol=NEGLIGIBLE)

    def test_against_a_plain_loop(self):
        """Each Gaussian may differ by what is not evaluated; many are larger than the picture."""
        gaussians = furry_ball(40)
        camera = look_at((1.5, -1, 1.2), (0, 0, 0), (0, 0, 1), 30, (19, 23))
        for limits in ({}, {"least": LEAST, "stop": STOP}):
            difference = np.abs(render(gaussians, camera, **limits)
                                - naive(gaussians, camera, **limits))
            self.assertLess(difference.max(), 40 * NEGLIGIBLE)

    def test_order_and_limits(self):
        red, blue = (ball((0, 0, z), 0.5, 1.0, color) for z, color in ((4, (1, 0, 0)), (5, (0, 0, 1))))
        behind_us = ball((0, 0, -3), 0.5, 1.0)
        middle = render(joined(blue, red, behind_us), straight())[15, 20]
        np.testing.assert_allclose(middle, (MOST, 0, 0.01 * MOST, 1 - 0.01 ** 2), atol=1e-12)
        both = joined(red, blue, ball((0, 0, 6), 0.5, 1.0, (0, 1, 0)))
        middle = render(both, straight(), stop=STOP * 1.01)[15, 20]  # the second would pass it
        np.testing.assert_allclose(middle, (MOST, 0, 0, MOST), atol=1e-12)
        faint = ball((0, 0, 4), 0.5, 0.99 * LEAST)
        self.assertGreater(render(faint, straight()).max(), 0.9 * LEAST)
        self.assertEqual(render(faint, straight(), least=LEAST).max(), 0.0)
        self.assertEqual(render(red, straight(), near=4.5).max(), 0.0)

    def test_cameras(self):
        """A point is where similar triangles say, and the world may be turned with the camera."""
        camera = look_at((3, 1, -2), (0.2, 0.3, 0.1), (0, 1, 0), 60, SIZE)
        np.testing.assert_allclose(camera.position, (3, 1, -2), atol=1e-12)
        _, mean, _ = moments(render(ball((0.2, 0.3, 0.1), 0.02, 0.9), camera))
        np.testing.assert_allclose(mean, np.divide(SIZE, 2), atol=1e-6)  # symmetric about it
        upper = moments(render(ball((0.2, 0.5, 0.1), 0.02, 0.9), camera))[1]
        self.assertLess(upper[1], SIZE[1] / 2 - 1)
        # From +z with y up, x is to the right.
        camera = look_at((0, 0, 4), (0, 0, 0), (0, 1, 0), 60, SIZE)
        _, mean, _ = moments(render(ball((0.5, 0.25, 0), 0.02, 0.9), camera))
        # The footprint is 0.6 px wide: a sum over pixels is not quite its integral.
        np.testing.assert_allclose(mean, (SIZE[0] / 2 + 7.5, SIZE[1] / 2 - 3.75), atol=5e-3)

    def test_colors_of_a_lobe(self):
        """sum of w_l P_l(t), whose value is sum(w) along the axis; negative colours are 0."""
        axis = np.array([[0.36, -0.48, 0.8]])
        np.testing.assert_allclose(harmonics_at(axis)[:, :1], C0)
        gaussian = ball((0, 0, 0), 0.1, 1.0)
        gaussian.harmonics = np.repeat(lobe(axis, (0.1, 0.2, 0.4, 0.3))[:, :, None], 3, axis=2)
        along = colors_from(-5 * axis[0], gaussian)
        np.testing.assert_allclose(along, 0.5 + 1.0, atol=1e-12)
        direction = np.array([0.8, -0.6, 0.0])
        t = float(direction @ axis[0])
        legendre = np.array([1, t, (3 * t * t - 1) / 2, (5 * t ** 3 - 3 * t) / 2])
        np.testing.assert_allclose(colors_from(-2 * direction, gaussian),
                                   0.5 + legendre @ (0.1, 0.2, 0.4, 0.3), atol=1e-12)
        gaussian.harmonics[:] = 0
        gaussian.harmonics[0, 0] = -10
        self.assertEqual(colors_from(np.array([0, 0, -5.0]), gaussian).max(), 0.0)

    def test_lens(self):
        """What is in focus stays; elsewhere the variance of the disc of the lens is added, c^2 / 4 on
        each axis for a radius c = f R |1 / focus - 1 / z| px."""
        size, focus, radius, focal = (81, 61), 4.0, 0.3, 60.0
        camera = straight(focal, size)
        for z in (2.5, 4.0, 9.0):
            gaussian = ball((0.3 * z / 4, -0.2 * z / 4, z), 0.05, 0.1)  # faint: opacities add up
            sharp = moments(render(gaussian, camera))
            blurred = moments(render_lens(gaussian, camera, radius, focus, 400))
            c = focal * radius * abs(1 / focus - 1 / z)
            # 400 points; the footprint of another point of the lens differs by a few per cent.
            np.testing.assert_allclose(blurred[0], sharp[0], rtol=0.01)
            np.testing.assert_allclose(blurred[1], sharp[1], atol=0.01 + 0.01 * c)
            np.testing.assert_allclose(blurred[2], sharp[2] + c * c / 4 * np.eye(2),
                                       atol=0.02 + 0.015 * c * c)

    def test_points_of_the_lens(self):
        """Uniform on the disc: mean 0 and variance R^2 / 4 on each axis."""
        points = aperture_points(1000, 2.0)
        self.assertLess(np.linalg.norm(points, axis=1).max(), 2.0)
        np.testing.assert_allclose(points.mean(axis=0), 0, atol=0.01)
        np.testing.assert_allclose(points.T @ points / 1000, np.eye(2), atol=0.01)
        moved = behind(straight(), (0.5, -0.25), 4.0)
        np.testing.assert_allclose(moved.position, (0.5, -0.25, 0), atol=1e-12)


if __name__ == "__main__":
    unittest.main()
