// SPDX-License-Identifier: BSD-3-Clause
/**
 * The nodes of a cloud as the camera of a cut sees them: where they are on the screen and in depth,
 * how much the lens blurs them, and which of them it cannot see. Internal to SelectCut.
 */
#pragma once

#include "Core/Base/Geometry.h"
#include "Core/Hierarchy/ClusterBounds.h"
#include "Core/Hierarchy/CutSettings.h"

#include <array>
#include <cmath>

namespace SurfelSplatting
{
/// Sphere in camera space that contains the centres of a node's leaves.
struct NodeBall
{
  Vector3 Center;
  double Radius;
  double Near() const { return this->Center[2] - this->Radius; }
  double Far() const { return this->Center[2] + this->Radius; }
};

/// Largest standard deviations of a run's nodes, and of its ancestors; 0: it has none. Local units.
struct RunDeviations
{
  double Own, OfAncestors;
};

class CutView
{
public:
  /// All must outlive this.
  CutView(const SurfelCloud& cloud, const CutCamera& camera, const CutSettings& settings);

  NodeBall BallOf(const ClusterBounds::Node& node) const
  {
    return { this->LocalToCamera.Apply({ node.Position[0], node.Position[1], node.Position[2] }),
      this->Scale * node.Extent.Size };
  }

  /// Whether the ball reaches behind the lens's centre, so that it may be seen anywhere.
  bool IsAroundLens(const NodeBall& ball) const
  {
    return !this->Camera.Parallel && !(ball.Near() > 0.0);
  }

  /// Radius of the lens's blur where it is smallest in a ball that is not around the lens, px.
  double SmallestConfusion(const NodeBall& ball) const;

  /// Width of a pixel at a ball that is not around the lens, local units.
  double WidthOfPixel(const NodeBall& ball) const;

  /// Whether nothing below the node can reach the picture, including blur.
  bool IsOutside(const ClusterBounds::Node& node, const NodeBall& ball) const;

  /// Whether n . (x - c) > 0 for all normals n of the node's cone, points x of the ball, and points
  /// c of the lens.
  bool FacesAway(const ClusterBounds::Node& node, const NodeBall& ball) const;

  /// Bounds a run's splats on the screen and in depth.
  void Bound(const RunDeviations& local, const NodeBall& ball, CutRange& run) const;

private:
  /// x or y on the screen.
  struct Axis
  {
    Axis(double focal, double center, int size);

    double Focal;  ///< Fx or Fy of the view
    double Center; ///< Cx or Cy
    int Size;      ///< of the picture, px
    /// Lengths of the normals (Focal, border) of the planes through the lens and the borders.
    double LowNormal, HighNormal;
  };

  struct PixelInterval
  {
    int Begin, End;
  };

  double LargestReach(double size, double confusion, bool wide) const;
  PixelInterval CoveredPixels(
    double x, const NodeBall& ball, const Axis& axis, double margin) const;
  bool IsBeyond(double x, double z, const Axis& axis, double margin) const;

  const View& Camera;
  const Lens& Optics;
  bool InSpace; ///< Gaussians, not surfels
  double LensVariance, CellShare, LongestAxis, CellReach, SupportRadius, Prefilter;
  std::size_t Cells;
  Affine3 LocalToCamera;
  std::array<Vector3, 3> AreaToCamera;
  double FocalLength;
  Axis AxisX, AxisY;
  double Scale = 1.0; ///< largest by which LocalToCamera stretches a length
  bool ConesHold = true;
};
}
