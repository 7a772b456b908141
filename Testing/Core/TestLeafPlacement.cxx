// SPDX-License-Identifier: BSD-3-Clause
/**
 * Leaves that were moved away from their nodes: by which map, for solid and flat clouds, surfels
 * and Gaussians, at large coordinates too.
 */
#include "Core/Hierarchy/LeafPlacement.h"
#include "TestScene.h"
#include "Testing/Shared/Check.h"

#include <cmath>

using namespace SurfelSplatting;
using SurfelTesting::Near;

namespace
{
TestCloud Ball(int count, double thickness, bool twoSided)
{
  Random random(11);
  TestCloud cloud;
  for (int i = 0; i < count; ++i)
  {
    TestSurfel s;
    s.Normal = random.Direction();
    s.Position = { 3.0 + s.Normal[0], s.Normal[1], thickness * s.Normal[2] };
    s.Normal = thickness > 0.0 ? s.Normal : Vector3{ 0, 0, 1 };
    s.Area = 12.57 / count * random.Uniform(0.5, 1.5);
    s.SigmaU = s.SigmaV = 0.5 * std::sqrt(s.Area);
    s.TwoSided = twoSided && i % 3 == 0;
    cloud.Add(s);
  }
  return cloud;
}

/// The leaves after a map, in double.
struct MovedLeaves
{
  MovedLeaves(const TestHierarchy& hierarchy, const Affine3& map)
    : Cloud(hierarchy.Get())
  {
    for (std::size_t i = 0; i < this->Cloud.NumberOfSurfels; ++i)
    {
      const Vector3 p = map.Apply(this->Cloud.Position(i));
      this->Positions.insert(this->Positions.end(), p.begin(), p.end());
    }
    this->Cloud.PositionsFloat = nullptr;
    this->Cloud.PositionsDouble = this->Positions.data();
  }

  std::vector<double> Positions;
  SurfelCloud Cloud;
};

Affine3 Turn(double angle, double sx = 1.0, double sy = 1.0, double sz = 1.0)
{
  Affine3 map;
  map.L = { { { sx * std::cos(angle), 0, sz * std::sin(angle) }, { 0, sy, 0 },
    { -sx * std::sin(angle), 0, sz * std::cos(angle) } } };
  map.T = { 5.0, -2.0, 0.5 };
  return map;
}

Affine3 Shift(double x, double y, double z)
{
  Affine3 map;
  map.T = { x, y, z };
  return map;
}

void CheckFound(const TestHierarchy& hierarchy, const Affine3& map, LeafPlacement::MoveKind kind)
{
  const MovedLeaves moved(hierarchy, map);
  const LeafPlacement found = FindLeafPlacement(moved.Cloud, hierarchy.Order.Layout);
  CHECK(found.Kind == kind);
  for (int i = 0; i < 3; ++i)
  {
    CHECK_NEAR(found.Map.T[i], map.T[i], 1e-4);
    for (int j = 0; j < 3; ++j)
    {
      CHECK_NEAR(found.Map.L[i][j], map.L[i][j], 1e-4);
    }
  }
}

TEST_CASE("Maps")
{
  for (const double thickness : { 1.0, 0.01, 0.0 })
  {
    for (const bool twoSided : { false, true })
    {
      const TestHierarchy hierarchy(Ball(5000, thickness, twoSided));
      CheckFound(hierarchy, Affine3(), LeafPlacement::None);
      CheckFound(hierarchy, Shift(0, 0.2, 0), LeafPlacement::Translation);
      CheckFound(hierarchy, Shift(691608.25, 5334780.5, 512.0), LeafPlacement::Translation);
      CheckFound(hierarchy, Turn(0.7), LeafPlacement::AffineMap);
      CheckFound(hierarchy, Turn(0.02), LeafPlacement::AffineMap);
      CheckFound(hierarchy, Turn(Pi), LeafPlacement::AffineMap);
      CheckFound(hierarchy, Turn(-1.2, 2.0, 2.0, 2.0), LeafPlacement::AffineMap);
    }
  }
  const TestHierarchy ball(Ball(5000, 1.0, true));
  CheckFound(ball, Turn(0.4, 0.1, 3.0, 1.0), LeafPlacement::AffineMap);
  CheckFound(ball, Turn(0.4, -1.0, 1.0, 1.0), LeafPlacement::AffineMap); // mirrored
}

TEST_CASE("Area vectors")
{
  TestHierarchy hierarchy(Ball(5000, 1.0, true));
  const Affine3 map = Turn(0.7);
  CHECK(!FindLeafPlacement(MovedLeaves(hierarchy, map).Cloud, hierarchy.Order.Layout).MovedVectors);
  for (std::size_t i = 0; i < hierarchy.AreaVectors.size(); i += 3)
  {
    float* a = hierarchy.AreaVectors.data() + i;
    const Vector3 turned = map.ApplyLinear({ a[0], a[1], a[2] });
    std::copy(turned.begin(), turned.end(), a);
  }
  CHECK(FindLeafPlacement(MovedLeaves(hierarchy, map).Cloud, hierarchy.Order.Layout).MovedVectors);
}

TEST_CASE("Gaussians")
{
  Random random(12);
  for (const CloudKind kind : { CloudKind::Capture, CloudKind::Volume })
  {
    TestCloud cloud;
    cloud.Kind = kind;
    for (int i = 0; i < 3000; ++i)
    {
      TestGaussian g;
      g.Position = { random.Uniform(-1, 1), random.Uniform(-1, 1), random.Uniform(-1, 1) };
      g.Density = static_cast<float>(random.Uniform(0.1, 0.9));
      cloud.Add(g);
    }
    const TestHierarchy hierarchy(cloud);
    CheckFound(hierarchy, Affine3(), LeafPlacement::None);
    CheckFound(hierarchy, Shift(0, 0, 0.3), LeafPlacement::Translation);
    CheckFound(hierarchy, Turn(0.5), LeafPlacement::AffineMap);
  }
}

TEST_CASE("What no map explains")
{
  const TestHierarchy hierarchy(Ball(5000, 1.0, true));
  MovedLeaves bent(hierarchy, Affine3());
  for (std::size_t i = 0; i < bent.Positions.size(); i += 3)
  {
    bent.Positions[i + 2] += 0.2 * std::sin(4.0 * bent.Positions[i]);
  }
  CHECK(FindLeafPlacement(bent.Cloud, hierarchy.Order.Layout).Kind == LeafPlacement::Other);
  const MovedLeaves flat(hierarchy, Turn(0.0, 1.0, 0.0, 1.0));
  CHECK(FindLeafPlacement(flat.Cloud, hierarchy.Order.Layout).Kind == LeafPlacement::Other);
  for (const int count : { 0, 1, 2, 3 })
  {
    const TestHierarchy few(Ball(count, 1.0, false));
    CHECK(FindLeafPlacement(few.Get(), few.Order.Layout).Kind == LeafPlacement::None);
    const MovedLeaves turned(few, Turn(0.5));
    const LeafPlacement found = FindLeafPlacement(turned.Cloud, few.Order.Layout);
    CHECK(found.Kind != LeafPlacement::AffineMap);
  }
}
}
