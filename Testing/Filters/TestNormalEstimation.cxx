// SPDX-License-Identifier: BSD-3-Clause
// The filter's normals against closed forms, against a solver of another kind (the one that the
// filter used before PCL's), and against pcl::NormalEstimation; near the origin and at the
// coordinates of maps.
#include "Filters/Neighbors/NeighborSearch.h"
#include "SurfelTesting.h"

#include "vtkSurfelEstimation.h"

#include <Eigen/Eigenvalues>
#include <pcl/features/normal_3d.h>
#include <pcl/point_types.h>

#include <algorithm>
#include <cmath>
#include <memory>

using namespace SurfelTesting;
using SurfelGeometry::Neighbors;
using SurfelGeometry::NeighborSearch;

namespace
{
constexpr int Count = 16; // neighbours: the filter's default

/// Degrees between two directions whose signs do not matter. The sine is exact at small angles.
double Angle(const Vec& a, const Vec& b)
{
  const Vec c{ a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0] };
  return std::atan2(Length(c), std::abs(Dot(a, b))) * 180.0 / Pi;
}

/// Positions in float about the origin that the filter chose, and a tree of them.
struct Cloud
{
  std::vector<float> Positions;
  std::unique_ptr<NeighborSearch> Tree;

  Cloud(const std::vector<Vec>& points, const double origin[3])
  {
    for (const Vec& p : points)
    {
      for (int c = 0; c < 3; ++c)
      {
        this->Positions.push_back(static_cast<float>(p[c] - origin[c]));
      }
    }
    this->Tree =
      std::make_unique<NeighborSearch>(this->Positions.data(), static_cast<int>(points.size()));
  }

  Eigen::Vector3d Position(int i) const
  {
    const float* p = this->Positions.data() + 3 * static_cast<size_t>(i);
    return { p[0], p[1], p[2] };
  }
};

/// The normals of planes through the points and their neighbours, by Eigen's iterative solver.
std::vector<Vec> NormalsByEigen(const Cloud& cloud)
{
  std::vector<Vec> normals;
  Neighbors found;
  for (int i = 0; i < cloud.Tree->Size(); ++i)
  {
    cloud.Tree->FindNearest(i, Count, found);
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    Eigen::Matrix3d squares = Eigen::Matrix3d::Zero();
    for (const int j : found.Ids)
    {
      const Eigen::Vector3d d = cloud.Position(j) - cloud.Position(i);
      sum += d;
      squares += d * d.transpose();
    }
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(
      squares - sum * sum.transpose() / (found.Count() + 1.0));
    const Eigen::Vector3d n = solver.eigenvectors().col(0);
    normals.push_back({ n[0], n[1], n[2] });
  }
  return normals;
}

/// PCL's filter with our search; it computes in float.
std::vector<Vec> NormalsByPCL(const Cloud& cloud)
{
  const auto points = pcl::make_shared<pcl::PointCloud<pcl::PointXYZ>>();
  for (int i = 0; i < cloud.Tree->Size(); ++i)
  {
    points->push_back(pcl::PointXYZ(
      cloud.Positions[3 * i], cloud.Positions[3 * i + 1], cloud.Positions[3 * i + 2]));
  }
  pcl::NormalEstimation<pcl::PointXYZ, pcl::Normal> estimation;
  estimation.setInputCloud(points);
  estimation.setSearchMethod(
    pcl::search::Search<pcl::PointXYZ>::Ptr(cloud.Tree.get(), [](NeighborSearch*) {}));
  estimation.setKSearch(Count + 1); // with the point itself
  pcl::PointCloud<pcl::Normal> output;
  estimation.compute(output);
  std::vector<Vec> normals;
  for (const pcl::Normal& n : output)
  {
    normals.push_back({ n.normal_x, n.normal_y, n.normal_z });
  }
  return normals;
}

/// Largest and mean angle between two lists of directions, degrees.
Spread Angles(const std::vector<Vec>& a, const std::vector<Vec>& b)
{
  REQUIRE(a.size() == b.size());
  std::vector<double> angles;
  for (size_t i = 0; i < a.size(); ++i)
  {
    angles.push_back(Angle(a[i], b[i]));
  }
  return Spread(angles);
}

void TestSurface(Sampled surface, const Vec& at)
{
  surface.Shift(at);
  vtkNew<vtkSurfelEstimation> estimation;
  estimation->SetInputData(ToPolyData(surface.Points, VTK_DOUBLE));
  estimation->Update();
  vtkPolyData* output = estimation->GetOutput();
  const Surfels surfels(output);
  std::vector<Vec> normals;
  for (vtkIdType i = 0; i < surfels.Count(); ++i)
  {
    normals.push_back(surfels.Normal(i));
  }
  double origin[3];
  output->GetFieldData()->GetArray(SurfelSplatting::Arrays::Origin)->GetTuple(0, origin);
  const Cloud cloud(surface.Points, origin);
  const std::vector<Vec> before = NormalsByEigen(cloud);
  CHECK(Angles(normals, before).Maximum <= 0.1);
  CHECK(Angles(normals, NormalsByPCL(cloud)).Maximum <= 0.1);
  CHECK(Angles(normals, surface.Normals).Mean <= Angles(before, surface.Normals).Mean + 1e-3);
  CHECK(Angles(normals, surface.Normals).Maximum <= Angles(before, surface.Normals).Maximum + 0.1);
}
}

TEST_CASE("Normals are those of PCL and of another solver")
{
  for (const Vec& at : { Vec{ 0.0, 0.0, 0.0 }, Vec{ 691234.567, 5335123.456, 512.0 } })
  {
    TestSurface(MakeSphere(1.0, 20000, Random(1)), at);
    TestSurface(MakeTube(0.1, 1.0, 0.01, false, Random(2)), at);
    TestSurface(
      MakeRectangle({ 0, 0, 0 }, { 0.6, 0, 0.8 }, 1, { 0, 1, 0 }, 1, 0.01, 1.0, Random(3)), at);
  }
}
