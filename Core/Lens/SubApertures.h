// SPDX-License-Identifier: BSD-3-Clause
/**
 * Divides a lens into several smaller ones whose pictures are averaged. With more of them, the
 * picture approaches that of a distributed ray tracer.
 *
 * A single picture knows the visibility of layers over the lens by moments only
 * (LensVisibility.h), and takes the footprint of a splat as the same from everywhere on the lens.
 * Each of K cells of equal area looks through a K-th of the lens from its own centre, so both
 * errors shrink with K. With pinholes instead of cells this is multisampling of the lens (Haeberli
 * and Akeley 1990).
 *
 * The cells are sectors of rings, and stand for them as ellipses: the one of a sector has its mean
 * and its covariance, so that all together have those of the lens. A sector between the radii a and
 * b, of half the angle t, has, along the direction to its middle and across,
 *
 *   mean 2/3 (b^3 - a^3) / (b^2 - a^2) sin t / t
 *   E[x^2], E[y^2] = (a^2 + b^2) / 4 (1 +- sin 2t / 2t)
 *
 * and an ellipse a quarter of its squared semi-axes as variances.
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

/// A cell: the ellipse that stands for a sector.
struct ApertureCell
{
  ApertureSample Center;
  double Radius; ///< of the disc of the same area, in units of the lens's radius
  LensShape Shape;
};

/**
 * K cells, innermost first: up to 4 are on one ring, 5 to 9 on a ring about a centre, 10 to 15 on
 * two rings, 16 to 23 on two rings about a centre, and so on: as far apart along a ring as the
 * rings are, since longer cells see less well what hides what.
 *
 * How well they blur decides how many dB cells gain, as much as their number: over all directions,
 * the root mean square difference of a blurred edge's profile from that through the whole lens is
 * at most 0.046 / K up to 64 cells. With equal discs it is up to 0.115 / K, and pictures of thin
 * things were worse through two to four cells than one picture.
 * @param count K >= 1
 */
std::vector<ApertureCell> ApertureCells(int count);

/**
 * N >= 1 points on such rings that sample the disc of the lens evenly, with its mean and its
 * mean squared distance. Compared with the spiral of Vogel (1979), whose error falls nearly as 1/N,
 * the rings were measured to be 1 to 7 dB nearer to the limit at every N from 10 on.
 */
std::vector<ApertureSample> ApertureSamples(int count);

/// How a lens is divided.
struct ApertureSampling
{
  int Count = 1;         ///< of cells, >= 1
  bool Pinholes = false; ///< sample the lens by pinholes at points instead of by cells
  /// Cells are rendered everywhere, not only where they may change the picture.
  bool Everywhere = false;
};

/// View and lens of one of the cells or pinholes.
struct SubAperture
{
  View Camera;
  Lens Optics;
  Vector3 Center{ { 0, 0, 0 } }; ///< in the camera space of the whole lens, world units
};

/**
 * The cells of a lens. The plane in focus looks the same from all of them. Without a lens (pinhole
 * or parallel projection) there is one cell, the view as it is.
 */
std::vector<SubAperture> DivideLens(
  const View& view, const Lens& lens, const ApertureSampling& sampling);

/// Whether DivideLens would return the lens undivided.
bool IsWhole(const View& view, const Lens& lens, const ApertureSampling& sampling);
}
