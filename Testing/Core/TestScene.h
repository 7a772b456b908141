// SPDX-License-Identifier: BSD-3-Clause
/**
 * What the tests of the core share: clouds built surfel by surfel, and pictures.
 */
#pragma once

#include "Core/Base/ThreadExecutor.h"
#include "Core/Hierarchy/ClusterBounds.h"
#include "Core/Hierarchy/SheetOverlap.h"
#include "Core/Hierarchy/HierarchyBuilder.h"
#include "Core/Hierarchy/KdTreeOrder.h"
#include "Core/Hierarchy/NodeColors.h"
#include "Core/Hierarchy/NodeHarmonics.h"
#include "Core/Picture/Splatter.h"
#include "Testing/Shared/Random.h"

#include <vector>

namespace SurfelSplatting
{
using SurfelTesting::Random;

struct TestSurfel
{
  Vector3 Position{ 0, 0, 1 };
  Vector3 Normal{ 0, 0, -1 }; ///< unit length
  double SigmaU = 0.01; ///< standard deviations of the reconstruction kernel, in the tangent plane
  double SigmaV = 0.01;
  double Area = 1e-4;
  std::array<float, 4> Color{ { 1, 1, 1, 1 } };
  float Opacity = 1.0f;
  bool TwoSided = false;
  int Overlap = 0; ///< 0 to 255
};

/// A Gaussian in space.
struct TestGaussian
{
  Vector3 Position{ 0, 0, 1 };
  Symmetric3 Covariance{ 1e-4, 1e-4, 1e-4, 0, 0, 0 };
  float Density = 1.0f; ///< opacity or extinction (CloudKind)
  std::array<float, 4> Color{ { 1, 1, 1, 1 } };
  Vector3 Normal{ 0, 0, 0 }; ///< mean, length 0 to 1; counts with TestCloud::HasNormals
};

/// R diag(sigma^2) R' with the rows of R from a random rotation.
Symmetric3 RandomCovariance(const Vector3& sigma, Random& random);

/// Stands for a square of a plane that faces -z: the standard deviation is half the side.
TestSurfel SquareSurfel(const Vector3& position, double side, double coverage = 1.0);

/// Owns the arrays that a SurfelCloud points into.
class TestCloud
{
public:
  Affine3 LocalToWorld;
  Material Surface;
  double Opacity = 1.0;

  std::vector<double> Positions;
  std::vector<float> Covariances, AreaVectors, Opacities, Colors;
  std::vector<unsigned char> TwoSided, Overlaps;

  /// Of Gaussians in space.
  CloudKind Kind = CloudKind::Surfels;
  std::vector<float> Densities, Normals;
  bool HasNormals = false;
  std::vector<float> Harmonics; ///< [n][NumberOfHarmonics][3], or empty
  int NumberOfHarmonics = 0;

  void Add(const TestSurfel& surfel);
  void Add(const TestGaussian& gaussian);

  /// Without harmonics, which only a hierarchy packs.
  SurfelCloud Get() const;
};

/// A hierarchy over a cloud, with its arrays.
class TestHierarchy
{
public:
  explicit TestHierarchy(const TestCloud& cloud, const Executor& executor = SerialExecutor());

  /// Leaves and nodes; drawn level by level as the context says. Positions are floats.
  SurfelCloud Get() const;
  std::size_t NumberOfNodes() const { return this->Order.Layout.NumberOfNodes(); }

  KdTreeOrder Order;
  std::vector<float> Positions, Covariances, AreaVectors, Opacities, LeafColors; ///< of the leaves
  std::vector<unsigned char> TwoSided, Overlaps;
  std::vector<float> Densities, Normals;
  std::vector<PackedHarmonics> Harmonics; ///< of leaves and nodes
  std::vector<HierarchyNode> Nodes;
  std::vector<float> LeafCovariances;
  std::vector<NodeColor> Colors;
  ClusterBounds Table;

private:
  Affine3 LocalToWorld;
  Material Surface;
  CloudKind Kind;
  bool HasNormals;
  int NumberOfHarmonics;
};

/// A frame with memory of its own, filled with NaN so that a pixel that is not written is seen.
class Picture
{
public:
  Picture(int width, int height);
  Frame Get();

  const int Width, Height;
  std::vector<float> Color, Depth;

  float At(int x, int y, int channel) const { return Color[4 * Index(x, y) + channel]; }
  float DepthAt(int x, int y) const { return Depth[Index(x, y)]; }
  std::size_t Index(int x, int y) const { return static_cast<std::size_t>(y) * Width + x; }
};

/// Settings with the kernel to test: the program's argument, gaussian or pearson.
SplatContext TestContext();

/// Looks along z from the origin; principal point in the middle of the picture.
View PinholeView(int width, int height, double focalLength);

Picture RenderPicture(const SplatContext& context, const std::vector<SurfelCloud>& clouds,
  const Executor& executor = SerialExecutor(), const float* occluderDepth = nullptr,
  LayerSink* sink = nullptr);
Picture RenderPicture(const SplatContext& context, const TestCloud& cloud);

/// Differences of two pictures' colors, on their own scale.
double LargestDifference(const Picture& a, const Picture& b);
double MeanSquareDifference(const Picture& a, const Picture& b);

/// Whether every pixel is written, finite and not negative, and alpha is at most 1.
bool IsSane(const Picture& picture);
double SumOfAlpha(const Picture& picture);

/// Whether colors and depths are equal bit for bit.
bool Same(const Picture& a, const Picture& b);

/// Pieces of another size, last first: what a scheduler is free to do.
class BackwardExecutor : public Executor
{
public:
  void For(std::size_t size, std::size_t grain, const RangeFunction& function) const override
  {
    const std::size_t piece = 3 * grain;
    for (std::size_t end = size; end > 0;)
    {
      const std::size_t begin = end > piece ? end - piece : 0;
      function(begin, end);
      end = begin;
    }
  }
};

inline Vector3 Normalized(const Vector3& v)
{
  return (1.0 / Norm(v)) * v;
}

/// Unit vectors that span the plane across a unit normal.
void Tangents(const Vector3& normal, Vector3& u, Vector3& v);

/// Light leaving a surfel towards the lens, by Core/Surfels/Shading.h with one lane.
/// @param ambientColor its ambient colour, which may be another than its own
std::array<double, 3> Shade(const Material& material, const std::vector<Light>& lights,
  const std::array<double, 3>& color, const std::array<double, 3>& ambientColor,
  const Vector3& position, const Vector3& normal, const Vector3& toViewer);
}
