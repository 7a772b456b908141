// SPDX-License-Identifier: BSD-3-Clause
#include "Filters/Cleaning/NearCopies.h"

#include "Filters/Cleaning/CleaningProblem.h"
#include "Filters/Common/ArrayTuples.h"
#include "Filters/Neighbors/Neighbors.h"

#include <algorithm>
#include <cstddef>

namespace SurfelGeometry
{
namespace
{
/// Points are copies if the next other point is so many times as far away. Of random points on a
/// surface, one in the square of this has such a neighbour.
constexpr float CopyGap = 10.0f;

/// A point has at most so many copies: files in which each triangle has its own corners have five.
constexpr int MostCopies = 7;

/// About so many points tell whether a cloud has copies: if more than this part of the points have
/// one. It is 1 % by chance, and 10 % of random points on lines.
constexpr double CopySamples = 2048.0;
constexpr double LeastCopied = 0.15;

class CopyTest
{
public:
  CopyTest(const CleaningProblem& problem, vtkDataArray* normals)
    : Problem(problem)
    , Normals(normals)
  {
  }

  /// The number of copies of a point, which are its nearest neighbours.
  int Count(int i, Neighbors& neighbors) const
  {
    this->Problem.Searched.Find(i, MostCopies + 1, neighbors);
    const std::vector<float>& squared = neighbors.SquaredDistances;
    for (int k = 1; k < neighbors.Count(); ++k)
    {
      if (squared[k] > CopyGap * CopyGap * squared[k - 1])
      {
        return k;
      }
    }
    return 0;
  }

  /// Whether one of them is before this point in the input.
  bool IsCopy(int i, Neighbors& neighbors) const
  {
    const int count = this->Count(i, neighbors);
    const int* ids = neighbors.Ids.data();
    return std::any_of(ids, ids + count, [&](int j) {
      const LocalCloud& cloud = this->Problem.Cloud();
      return cloud.SampleId(j) < cloud.SampleId(i) && !this->AreBackToBack(i, j);
    });
  }

private:
  bool AreBackToBack(int i, int j) const
  {
    if (!this->Normals)
    {
      return false;
    }
    const LocalCloud& cloud = this->Problem.Cloud();
    double a[3], b[3];
    ReadTuple(this->Normals, cloud.InputIds[i], a);
    ReadTuple(this->Normals, cloud.InputIds[j], b);
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2] < 0.0;
  }

  const CleaningProblem& Problem;
  vtkDataArray* Normals;
};
}

bool FindNearCopies(const CleaningProblem& problem, vtkDataArray* normals,
  const StageProgress& progress, std::vector<unsigned char>& copies)
{
  const LocalCloud& cloud = problem.Cloud();
  copies.assign(static_cast<std::size_t>(cloud.Size()), 0);
  const CopyTest test(problem, normals);
  std::vector<float> copied;
  Neighbors neighbors;
  for (const int i : problem.Samples(CopySamples / std::max(CopySamples, 1.0 * problem.Total())))
  {
    copied.push_back(test.Count(i, neighbors) > 0 ? 1.0f : 0.0f);
  }
  if (!problem.Gather(progress.Step(0.0), copied))
  {
    return false;
  }
  const auto count = std::count(copied.begin(), copied.end(), 1.0f);
  if (!(static_cast<double>(count) > LeastCopied * static_cast<double>(copied.size())))
  {
    return true;
  }
  return ParallelFor(cloud.Size(), progress, [&](vtkIdType begin, vtkIdType end) {
    Neighbors found;
    for (int i = static_cast<int>(begin); i < end; ++i)
    {
      copies[i] = test.IsCopy(i, found) ? 1 : 0;
    }
  });
}
}
