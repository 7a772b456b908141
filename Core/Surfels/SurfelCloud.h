// SPDX-License-Identifier: BSD-3-Clause
/**
 * A cloud of surfels as the core reads it: pointers into the caller's arrays
 * (Documentation/DataContract.md), the transform that places the cloud, and its material. Nothing
 * is copied or owned. A frame begins here: SplatMaker (Core/Splats) turns surfels into splats.
 */
#pragma once

#include "Core/Base/Geometry.h"
#include "Core/Surfels/GaussianMass.h"
#include "Core/Surfels/NodePacking.h"
#include "Core/Surfels/PackedHarmonics.h"
#include "Core/Surfels/Shading.h"

#include <cstddef>

namespace SurfelSplatting
{
class ClusterBounds;
class MemoryGuard;

/// What the cloud consists of. Gaussians in space (GaussianMass.h) have no area vectors and are
/// seen from all sides. Only volumes with Normals are lit.
enum class CloudKind
{
  Surfels,
  Capture, ///< Gaussians; Densities: opacity where a ray meets the centre, [0, 1]
  Volume   ///< Gaussians; Densities: extinction at the centre per world unit, >= 0
};

struct SurfelCloud
{
  std::size_t NumberOfSurfels = 0;

  /// If not null, the surfels are the leaves of a hierarchy, and a cut through it is drawn
  /// (HierarchyCut.h). The next three members hold the nodes above the leaves. Node i in
  /// HierarchyLayout's order is surfel i, or Nodes[i - NumberOfSurfels].
  const ClusterBounds* Clusters = nullptr;
  const HierarchyNode* Nodes = nullptr;
  const NodeColor* NodeColors = nullptr;  ///< or null: the colour of the material
  const float* LeafCovariances = nullptr; ///< [nodes][6] V_r, or null; for CutRule::Paper only

  /// If not null, the memory of the hierarchy is from a file and is checked before it is drawn.
  const MemoryGuard* Guard = nullptr;

  const float* PositionsFloat = nullptr;   ///< [n][3] local units; one of the two
  const double* PositionsDouble = nullptr; ///< [n][3]
  const float* Covariances = nullptr;      ///< [n][6] XX YY ZZ XY YZ XZ
  const float* AreaVectors = nullptr;      ///< [n][3]
  const unsigned char* TwoSided = nullptr; ///< [n], null: all one-sided
  const float* Opacities = nullptr;        ///< [n] in [0, 1], null: 1
  const unsigned char* Overlaps = nullptr; ///< [n] unit 1 / 255, null: 0 (OverlapOf)

  CloudKind Kind = CloudKind::Surfels;
  const float* Densities = nullptr; ///< [n] of Gaussians in space; see CloudKind
  const float* Normals = nullptr;   ///< [n][3] of volumes, lengths 0..1 (ShadeMeanNormal), or null
  const PackedHarmonics* Harmonics = nullptr; ///< [n + nodes] of Gaussians, or null: Color
  int NumberOfHarmonics = 0;                  ///< 1, 4, 9 or 16

  const unsigned char* ColorsUChar = nullptr; ///< [n][4] RGBA 0..255, straight alpha; or
  const float* ColorsFloat = nullptr; ///< [n][4] RGBA, straight alpha; or neither: Material.Color
  double Opacity = 1.0;               ///< of the whole cloud, [0, 1]
  double Prefilter = 0.0; ///< > 0: replaces SplatSettings::Prefilter, px^2; without Clusters only

  /// Whether surfels that have an outside are drawn from their backs, too; not Gaussians.
  bool ShowsBacks = false;

  Affine3 LocalToWorld; ///< local origin and actor matrix
  Material Surface;

  bool IsInSpace() const { return this->Kind != CloudKind::Surfels; }
  bool IsNode(std::size_t i) const { return i >= this->NumberOfSurfels; }
  const HierarchyNode& Node(std::size_t i) const { return this->Nodes[i - this->NumberOfSurfels]; }

  Vector3 Position(std::size_t i) const
  {
    if (this->IsNode(i))
    {
      return PositionOf(this->Node(i));
    }
    return this->PositionsFloat
      ? Vector3{ this->PositionsFloat[3 * i], this->PositionsFloat[3 * i + 1],
          this->PositionsFloat[3 * i + 2] }
      : Vector3{ this->PositionsDouble[3 * i], this->PositionsDouble[3 * i + 1],
          this->PositionsDouble[3 * i + 2] };
  }

  Symmetric3 Covariance(std::size_t i) const
  {
    if (this->IsNode(i))
    {
      return CovarianceOf(this->Node(i));
    }
    const float* s = this->Covariances + 6 * i;
    return { s[0], s[1], s[2], s[3], s[4], s[5] };
  }

  Vector3 AreaVector(std::size_t i) const
  {
    if (this->IsNode(i))
    {
      return AreaVectorOf(this->Node(i));
    }
    if (this->IsInSpace())
    {
      return { 0.0, 0.0, 0.0 };
    }
    const float* a = this->AreaVectors + 3 * i;
    return { a[0], a[1], a[2] };
  }

  /// By which a node weighs its surfels: their area, or the mass of Gaussians.
  double Area(std::size_t i) const
  {
    if (this->IsNode(i))
    {
      return this->Node(i).Area;
    }
    if (!this->IsInSpace())
    {
      return Norm(this->AreaVector(i));
    }
    const Symmetric3 covariance = this->Covariance(i);
    const double density = this->Densities[i] > 0.0f ? this->Densities[i] : 0.0;
    return this->Kind == CloudKind::Volume
      ? density * KernelVolume(covariance)
      : density * DepthOverOpacity(density) * MeanKernelArea(covariance);
  }

  bool IsTwoSided(std::size_t i) const
  {
    return this->IsInSpace() ||
      (this->IsNode(i) ? SurfelSplatting::IsTwoSided(this->Node(i))
                       : this->TwoSided && this->TwoSided[i]);
  }

  /// What other sheets close by cover of the surfel, [0, 1]: of two sheets the front one has 0 and
  /// the other 1, or both 1/2 if none is in front. This share of its weight is left out where the
  /// lens blurs them into one layer (SetupFootprint.h). Of captures' nodes, see CaptureOverlap.h.
  double OverlapOf(std::size_t i) const
  {
    return this->IsNode(i) ? SurfelSplatting::OverlapOf(this->Node(i))
      : this->Overlaps     ? this->Overlaps[i] / 255.0
                           : 0.0;
  }

  /// Opacity of the surfel itself, without that of its colour and of the cloud.
  double OwnOpacity(std::size_t i) const
  {
    return this->IsNode(i) ? OpacityOf(this->Node(i)) : this->Opacities ? this->Opacities[i] : 1.0;
  }

  /// Straight RGBA of a surfel before lighting; alpha includes the opacities of surfel and cloud.
  std::array<double, 4> Color(std::size_t i) const
  {
    if (this->IsNode(i) && this->NodeColors)
    {
      const ColorMoments n = UnpackColor(this->NodeColors[i - this->NumberOfSurfels]);
      return { n.Color[0], n.Color[1], n.Color[2], n.Opacity * this->Opacity };
    }
    std::array<double, 4> c{ Surface.Color[0], Surface.Color[1], Surface.Color[2], 1.0 };
    if (!this->IsNode(i) && this->ColorsUChar)
    {
      const unsigned char* u = this->ColorsUChar + 4 * i;
      c = { u[0] / 255.0, u[1] / 255.0, u[2] / 255.0, u[3] / 255.0 };
    }
    else if (!this->IsNode(i) && this->ColorsFloat)
    {
      const float* f = this->ColorsFloat + 4 * i;
      c = { f[0], f[1], f[2], f[3] };
    }
    c[3] *= this->Opacity * this->OwnOpacity(i);
    return c;
  }
};
}
