// SPDX-License-Identifier: BSD-3-Clause
/**
 * Baseline for the speed of the filters: only the search for the 16 neighbours of every point, with
 * the trees of PCL, FLANN and VTK. The points lie on a bumpy sphere, in random order; trees are
 * rebuilt every round.
 *
 *   NeighborSpeed [points = 1000000] [rounds = 3]
 *
 * prints a line of JSON: seconds, medians, as many threads as VTK may use.
 */
#include <flann/algorithms/dist.h>
#include <flann/algorithms/kdtree_single_index.h>
#include <pcl/kdtree/kdtree_flann.h>
#include <pcl/point_types.h>

#include "vtkFloatArray.h"
#include "vtkIdList.h"
#include "vtkNew.h"
#include "vtkPoints.h"
#include "vtkPolyData.h"
#include "vtkSMPTools.h"
#include "vtkStaticPointLocator.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <functional>
#include <map>
#include <random>
#include <string>
#include <vector>

namespace
{
constexpr int Neighbors = 16, Wanted = Neighbors + 1; // with the point itself
constexpr vtkIdType Grain = 1024;

std::vector<float> BumpySphere(int count)
{
  std::mt19937 random(1);
  std::normal_distribution<double> normal;
  std::vector<float> positions;
  positions.reserve(3 * static_cast<size_t>(count));
  for (int i = 0; i < count; ++i)
  {
    double p[3], squared = 0.0, bump = 0.08;
    for (double& x : p)
    {
      x = normal(random);
      squared += x * x;
    }
    for (double& x : p)
    {
      x /= std::sqrt(squared);
      bump *= std::sin(9.0 * x);
    }
    for (const double x : p)
    {
      positions.push_back(static_cast<float>((1.0 + bump) * x));
    }
  }
  return positions;
}

void SearchByPCL(const std::vector<float>& positions)
{
  const pcl::PointCloud<pcl::PointXYZ>::Ptr cloud(new pcl::PointCloud<pcl::PointXYZ>);
  for (size_t i = 0; i < positions.size(); i += 3)
  {
    cloud->push_back({ positions[i], positions[i + 1], positions[i + 2] });
  }
  pcl::KdTreeFLANN<pcl::PointXYZ> tree;
  tree.setInputCloud(cloud);
  const auto count = static_cast<vtkIdType>(cloud->size());
  vtkSMPTools::For(0, count, Grain, [&](vtkIdType begin, vtkIdType end) {
    std::vector<int> ids;
    std::vector<float> distances;
    for (vtkIdType i = begin; i < end; ++i)
    {
      tree.nearestKSearch((*cloud)[i], Wanted, ids, distances);
    }
  });
}

void SearchByFLANN(const std::vector<float>& positions)
{
  using Index = flann::KDTreeSingleIndex<flann::L2_Simple<float>>;
  const auto count = static_cast<vtkIdType>(positions.size() / 3);
  auto* data = const_cast<float*>(positions.data()); // only read
  Index index(flann::Matrix<float>(data, count, 3), flann::KDTreeSingleIndexParams(15));
  index.buildIndex();
  vtkSMPTools::For(0, count, Grain, [&](vtkIdType begin, vtkIdType end) {
    const size_t rows = end - begin;
    std::vector<size_t> ids(Wanted * rows);
    std::vector<float> distances(Wanted * rows);
    flann::Matrix<size_t> idRows(ids.data(), rows, Wanted);
    flann::Matrix<float> distanceRows(distances.data(), rows, Wanted);
    const flann::Matrix<float> queries(data + 3 * begin, rows, 3);
    index.knnSearch(queries, idRows, distanceRows, Wanted,
      flann::SearchParams(flann::FLANN_CHECKS_UNLIMITED, 0.0f, true));
  });
}

void SearchByVTK(const std::vector<float>& positions)
{
  const auto count = static_cast<vtkIdType>(positions.size() / 3);
  vtkNew<vtkFloatArray> array;
  array->SetNumberOfComponents(3);
  array->SetArray(const_cast<float*>(positions.data()), 3 * count, 1);
  vtkNew<vtkPoints> points;
  points->SetData(array);
  vtkNew<vtkPolyData> data;
  data->SetPoints(points);
  vtkNew<vtkStaticPointLocator> locator;
  locator->SetDataSet(data);
  locator->BuildLocator();
  vtkSMPTools::For(0, count, Grain, [&](vtkIdType begin, vtkIdType end) {
    vtkNew<vtkIdList> ids;
    for (vtkIdType i = begin; i < end; ++i)
    {
      double p[3];
      points->GetPoint(i, p);
      locator->FindClosestNPoints(Wanted, p, ids);
    }
  });
}
}

int main(int argc, char** argv)
{
  const int count = argc > 1 ? std::atoi(argv[1]) : 1000000;
  const int rounds = argc > 2 ? std::atoi(argv[2]) : 3;
  if (count < 100 || rounds < 1)
  {
    std::fprintf(stderr, "NeighborSpeed [points >= 100] [rounds >= 1]\n");
    return 1;
  }
  const std::vector<float> positions = BumpySphere(count);
  const std::map<std::string, std::function<void(const std::vector<float>&)>> ways{
    { "PCL", SearchByPCL }, { "FLANN", SearchByFLANN }, { "VTK", SearchByVTK }
  };
  std::map<std::string, std::vector<double>> seconds;
  for (int round = 0; round < rounds; ++round)
  {
    for (const auto& [name, search] : ways)
    {
      const auto began = std::chrono::steady_clock::now();
      search(positions);
      const std::chrono::duration<double> took = std::chrono::steady_clock::now() - began;
      seconds[name].push_back(took.count());
    }
  }
  const char* separator = "{";
  for (auto& [name, times] : seconds)
  {
    std::nth_element(times.begin(), times.begin() + times.size() / 2, times.end());
    std::printf("%s\"%s\": %.4f", separator, name.c_str(), times[times.size() / 2]);
    separator = ", ";
  }
  std::printf("}\n");
  return 0;
}
