// SPDX-License-Identifier: BSD-3-Clause
// Kernels leave no holes: in random samplings and where the density changes at once.
#include "SurfelTesting.h"

#include "vtkSurfelEstimation.h"
#include "vtkSurfelNormalization.h"

#include "vtkIdList.h"
#include "vtkStaticPointLocator.h"

#include <algorithm>

using namespace SurfelTesting;

namespace
{
/// Sums of the normalized kernels at the probes, ascending.
/// @param reach distance at which the widest kernel has ended
std::vector<double> SortedSums(const Sampled& surface, const Sampled& probes, double reach)
{
  vtkNew<vtkSurfelEstimation> estimation;
  estimation->SetInputData(ToPolyData(surface.Points));
  vtkNew<vtkSurfelNormalization> normalization;
  normalization->SetInputConnection(estimation->GetOutputPort());
  normalization->Update();
  const Surfels surfels(normalization->GetOutput());
  vtkNew<vtkStaticPointLocator> locator;
  locator->SetDataSet(normalization->GetOutput());
  locator->BuildLocator();
  vtkNew<vtkIdList> ids;
  std::vector<double> sums;
  for (const Vec& probe : probes.Points)
  {
    locator->FindPointsWithinRadius(reach, probe.data(), ids);
    double sum = 0.0;
    for (vtkIdType k = 0; k < ids->GetNumberOfIds(); ++k)
    {
      sum += surfels.Kernel(ids->GetId(k), probe);
    }
    sums.push_back(sum);
  }
  std::sort(sums.begin(), sums.end());
  return sums;
}

/// Uniformly random points in the square [0, 1]^2 and a denser half [-1, 0] x [0, 1].
Sampled MakeStep(int dense, int sparse, Random random)
{
  Sampled plane;
  for (int i = 0; i < dense + sparse; ++i)
  {
    plane.Add({ i < dense ? -random() : random(), random(), 0.0 }, { 0, 0, 1 });
  }
  return plane;
}

/// One point in 2000 of a random sampling has all its nearest points on one side; that is no
/// border.
TEST_CASE("Random sphere")
{
  for (const int seed : { 1, 2, 3 })
  {
    Sampled sphere, probes;
    Random random(seed);
    for (int i = 0; i < 80000; ++i)
    {
      const Vec p = random.Direction();
      (i < 20000 ? sphere : probes).Add(p, p);
    }
    CHECK(SortedSums(sphere, probes, 0.15).front() >= 0.5);
  }
}

/// The last dense points have no sparse ones among their nearest; that is no border either.
TEST_CASE("Step of density")
{
  const int dense = 20000;
  for (const int ratio : { 1, 3, 10, 30 })
  {
    const int sparse = dense / ratio;
    const double spacing = 1.0 / std::sqrt(sparse), margin = 3.0 * spacing;
    for (const int seed : { 5, 6 })
    {
      Sampled probes;
      Random random(seed + 100);
      for (int i = 0; i < 20000; ++i)
      {
        probes.Add({ random.Uniform(-spacing, spacing), random.Uniform(margin, 1.0 - margin), 0.0 },
          { 0, 0, 1 });
      }
      const Sampled plane = MakeStep(dense, sparse, Random(seed));
      const std::vector<double> sums = SortedSums(plane, probes, 4.0 * spacing);
      CHECK(sums[sums.size() / 100] >= (ratio < 30 ? 0.5 : 0.4));
      // Thin spots, smaller than a dense spacing.
      CHECK(sums.front() >= (ratio == 1 ? 0.5 : ratio < 30 ? 0.3 : 0.2));
    }
  }
}
}
