// SPDX-License-Identifier: BSD-3-Clause
/**
 * The raster of splats in double precision, a pixel at a time, with bounds on what rounding does to
 * it; random splats.
 */
#pragma once

#include "Core/Lens/Lens.h"
#include "Core/Raster/RasterTarget.h"
#include "ReferenceLayers.h"
#include "TestScene.h"
#include "WholeLens.h"

#include <algorithm>
#include <cmath>
#include <vector>

namespace SurfelSplatting
{
constexpr double Epsilon = 0x1p-24;
constexpr float Support = 5.0f;

/// Of the lens: an ellipse, as of cells.
constexpr LensShape ShapeOfLens{ 2.0, 0.625, 0.5 };

/// What a splat adds to a pixel, and bounds on what rounding does.
struct ScalarFragment
{
  bool IsInside = false;
  ReferenceFragment Values;
  double Error = 0.0; ///< of the weight, relative
  double ColorError = 0.0;
};

/// A pixel of the scalar evaluation. Beside its layers, the same with other roundings: what these
/// do to the pixel cannot be told beforehand, since each layer changes what is seen of the next.
struct ScalarPixel
{
  ReferenceLayers Layers;
  std::vector<ReferenceLayers> Moved;
  std::vector<ReferenceFragment> Next; ///< of the moved ones
  bool Undecided = false;
  double Terms = 0.0; ///< of the sums

  explicit ScalarPixel(const ReferenceLens& lens)
    : Layers(lens)
  {
    this->Layers.Flat = true;
    this->Moved.assign(4, this->Layers);
    for (std::size_t i = 0; i < this->Moved.size(); ++i)
    {
      this->Moved[i].Nudge = (i % 2 == 0 ? 8.0 : -8.0) * Epsilon;
    }
  }

  /// Ends what lies in front of the fragment. @param random of the roundings
  void Prepare(const ScalarFragment& f, Random& random)
  {
    this->Layers.Prepare(f.Values);
    this->Terms += 1.0;
    this->Next.assign(this->Moved.size(), f.Values);
    for (std::size_t i = 0; i < this->Moved.size(); ++i)
    {
      ReferenceFragment& moved = this->Next[i];
      const double change = 1.0 + random.Uniform(-f.Error, f.Error);
      moved.Weight *= change;
      moved.Color[0] += random.Uniform(-f.ColorError, f.ColorError);
      for (double& u : moved.U)
      {
        u += random.Uniform(-64.0 * Epsilon, 64.0 * Epsilon); // up to 0.08 a pixel, 60 px away
      }
      moved.Depth += random.Uniform(-64.0 * Epsilon, 64.0 * Epsilon); // of the plane, as far away
      this->Moved[i].Prepare(moved);
    }
  }

  /// Adds the prepared fragment.
  void Append(const ScalarFragment& f)
  {
    this->Layers.Append(f.Values);
    for (std::size_t i = 0; i < this->Moved.size(); ++i)
    {
      this->Moved[i].Append(this->Next[i]);
    }
  }

  void Tilt()
  {
    this->Layers.Tilt();
    for (ReferenceLayers& layers : this->Moved)
    {
      layers.Tilt();
    }
  }

  void Finish()
  {
    this->Layers.Finish();
    for (ReferenceLayers& layers : this->Moved)
    {
      layers.Finish();
    }
  }

  /// Bound on what rounding does: four times the largest of four draws, and the sums' own. A jump
  /// shows a decision that rounding makes.
  double Bound() const
  {
    double largest = 0.0;
    for (const ReferenceLayers& layers : this->Moved)
    {
      largest = std::max({ largest, std::abs(layers.Color[0] - this->Layers.Color[0]),
        std::abs(layers.Through - this->Layers.Through) });
    }
    // Each time that less than 1/512 of the light is left, rounding leaves half a unit of it, which
    // a division by the rest enlarges.
    const double left = 512.0 * Epsilon * this->Layers.FaintLeaks;
    return 4.0 * largest + 2.0 * Epsilon * (this->Terms + 8.0 * this->Layers.Leaks) + left;
  }
};

using ScalarTile = std::vector<ScalarPixel>;

struct PlacedSplat
{
  Splat S{};
  SplatGradient Gradient{};
  LensFootprint Footprint = WholeLens(0.0f, 0.0f, 0.0f);
  bool HasGradient = false;
  float X, Y;
  PixelBox Span;
};

/// Adds a splat; returns the number of its pixels. @param random of the roundings
std::uint64_t AddScalar(ScalarTile& tile, const PlacedSplat& splat, bool onLens, Random& random);

/// By ascending near depth, as the raster gets them; a few far outside of the tile, very long or
/// very small.
std::vector<PlacedSplat> RandomSplats(Random& random, int count);
}
