// SPDX-License-Identifier: BSD-3-Clause
/**
 * The layers of one pixel in double precision, from the formulas of ABuffer.h and LensVisibility.h:
 * fragments come by ascending near depth and each is weighted with T(u) at once. Nothing of the
 * raster's code is used, nor its short cuts:
 *
 * - The raster ignores T's first moments in a block of 16 pixels while they change what is seen by
 *   less than MinTilt = 1/512. It then takes the mean opacity of a layer for that of all of its
 *   lens points. Flat makes a pixel do that, until Tilt.
 * - It ends a layer at a gap of LargestGap bands, of which less than 1/1024 would stay.
 */
#pragma once

namespace SurfelSplatting
{
/// The lens that makes bands and moments; no radius: none.
struct ReferenceLens
{
  double Radius = 0.0, FocalDistance = 1.0; ///< world units
};

struct ReferenceFragment
{
  double Near = 0, Far = 0; ///< z-range of its splat
  double Weight = 0, Opacity = 1, Depth = 0;
  double Kernel = 1; ///< at the fragment, 1 at the splat's centre, 1/5 at a tent's
  double Color[3] = { 0, 0, 0 };
  double U[2] = { 0, 0 }; ///< point of the lens
  double Share = 1;       ///< the lens's of its footprint; unused of tents
  bool OnLens = false;    ///< else U is not used
  bool IsTent = false;    ///< is added in small parts, and has covariances:
  double ColorU[3][2] = {};
  double UU[2][2] = {};
};

/// A part of a layer that joined the finished ones.
struct ReferenceLeak
{
  double Color[3], Alpha, Depth;
};

class ReferenceLayers
{
public:
  explicit ReferenceLayers(const ReferenceLens& lens = {}, double limit = 1e300)
    : Lens(lens)
    , Limit(limit)
  {
  }

  void Add(const ReferenceFragment& f)
  {
    this->Prepare(f);
    this->Append(f);
  }

  /// The two parts of Add: what ends in front of the fragment leaks; it joins the open layer.
  void Prepare(const ReferenceFragment& f);
  void Append(const ReferenceFragment& f);

  bool Flat = false; ///< whether T's first moments are ignored

  /// Ends Flat.
  void Tilt();

  /// Ends the open layer.
  void Finish() { this->Leak(0.0); }

  /// Added to what a layer leaves of the light, as a share, and to its mean depth: for bounds on
  /// rounding, since T - v of a layer that leaves little is a difference, and its length as well.
  double Nudge = 0.0;

  static constexpr double LargestGap = 7.0; ///< bands

  // The picture so far.
  double Through = 1.0, ThroughU[2] = { 0, 0 };
  double ThroughUU[3] = { 0, 0, 0 }; ///< means of 2 |u|^2 - 1, u_x^2 - u_y^2, 2 u_x u_y times T(u)
  double Color[3] = { 0, 0, 0 };
  double Depth = 0.0;        ///< median
  double MedianMargin = 0.5; ///< how near the light behind a layer comes to 1/2
  ReferenceLeak Last{};
  int Leaks = 0;       ///< times that something joined the finished layers
  int FaintLeaks = 0;  ///< those of them behind which less than 1/512 of the light was left
  bool Tilted = false; ///< whether T has depended on u

  // The open layer.
  double Far = -1e300, Weight = 0, Opacity = 0, DepthSum = 0, Gaps = 0, Fill[2] = { 0, 0 };
  double Seen = 0, SeenU[2] = { 0, 0 }, SeenColor[3] = { 0, 0, 0 };

  /// Share of the lens through which the open layer is seen.
  double VisibleShare() const;

private:
  void Leak(double keep);
  void Shrink(double factor);
  void Composite(double share, double after);
  void Hide(double hidden, double x, double y);
  double Bend(const ReferenceFragment& f) const;
  double LargestCover() const;

  bool HasLeaked = false; // and nothing was added since: SeenU is valid
  ReferenceLens Lens;
  double Limit; // layers behind this depth are not seen
};

/// Of LensVisibility.h.
double ReferenceLargestMoment(double mean);
double ReferenceLargestCover(double centroid);
}
