// SPDX-License-Identifier: BSD-3-Clause
/**
 * A lens as several smaller ones, whose pictures are averaged: from one splatted picture to a
 * distributed ray tracer's.
 *
 * One picture takes the visibility of different layers over the lens for independent, and the
 * footprint of a splat for one and the same from all over the lens. Each of K cells of equal area
 * sees through a K-th of the lens from its own centre, so that both errors shrink with K. With
 * pinholes instead of cells this is multisampling of the lens (Haeberli and Akeley 1990).
 */
#pragma once

#include "Core/Lens/Lens.h"
#include "Core/Lens/View.h"

#include <vector>

namespace SurfelSplatting
{
/// A point of the lens in units of its radius: x right, y up in camera space.
struct ApertureSample
{
  double X, Y;
};

/**
 * Centres of K cells, each a disc of radius 1 / sqrt(K), innermost first: up to 5 on one ring, 6 to
 * 9 on a ring about a centre, more on further rings.
 *
 * The mean of the centres is 0 and the mean of their squared distances (1 - 1/K) / 2: with those of
 * the cells, 1 / (2K), it is the lens's, 1/2.
 * @param count K >= 1
 */
std::vector<ApertureSample> SubApertureCenters(int count);

/**
 * N >= 1 points that sample the lens's disc evenly, with its mean and its mean squared distance, on
 * the same rings. Against the spiral of Vogel (1979), whose error falls nearly as 1/N, rings were
 * measured to be nearer to the limit by 1 to 7 dB at every N from 10 on.
 */
std::vector<ApertureSample> ApertureSamples(int count);

/// A lens in cells, or in points.
struct ApertureSampling
{
  int Count = 1;         ///< of cells, >= 1
  bool Pinholes = false; ///< sample the lens at points, each a pinhole, instead of at cells
};

/// What one of the lens's cells or points sees through.
struct SubAperture
{
  View Camera;
  Lens Optics;
  Vector3 Center{ { 0, 0, 0 } }; ///< in the camera space of the whole lens, world units
};

/**
 * The cells of a lens; one, as it is, where there is nothing to divide: a pinhole or parallel
 * projection. The picture of the plane in focus is the same from all of them.
 */
std::vector<SubAperture> DivideLens(
  const View& view, const Lens& lens, const ApertureSampling& sampling);

/// Whether DivideLens would give one cell, the lens as it is.
bool IsWhole(const View& view, const Lens& lens, const ApertureSampling& sampling);
}
