// SPDX-License-Identifier: BSD-3-Clause
#include "Filters/Estimation/IsolatedPoints.h"

#include "Filters/Common/Median.h"
#include "Filters/Common/ParallelFor.h"
#include "Filters/Common/ParallelMedian.h"
#include "Filters/Estimation/ScanLines.h"
#include "Filters/Neighbors/NeighborGraph.h"
#include "Filters/Neighbors/SparseSurface.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace SurfelGeometry
{
namespace
{
/// A point is alone only if its nearest neighbour is at this share of its reach at least, since
/// what is beside a surface has all neighbours at about the same distance; and at so many times the
/// median reach of its neighbours, over `factor`.
constexpr double AloneShare = 0.6, AlonePerFactor = 0.5;

/// Points with a reach of 2 `factor` times that of the whole cloud, whose neighbours lie in no
/// plane, such as far returns of a scanner that turns, get at most `factor` times the cloud's
/// spacing.
constexpr double NoPlane = 0.09, SparseFactors = 2.0;

/// Finds isolated points, which would become giant discs: their reach exceeds `factor` times the
/// median reach of their neighbours, or factor^2 times that of the whole cloud (a group of
/// outliers, whose reaches are all large), or they are alone beside a surface: their nearest
/// neighbour is factor / 2 times as far as their neighbours reach, off the planes of most. They get
/// the median spacing of their neighbours, or of the cloud. Sparse points on no plane are bounded,
/// too. Where a surface goes on that is as sparse, the cloud's own spacing says nothing.
class IsolationTest
{
public:
  IsolationTest(const SearchedCloud& searched, const PlaneFits& fits, double factor)
    : Cloud(searched.Cloud)
    , Tree(*searched.Tree)
    , Graph(searched.Graph)
    , Fits(fits)
    , Factor(factor)
  {
    const auto count = static_cast<vtkIdType>(fits.size());
    this->Reaches.resize(fits.size());
    ParallelFor(0, count, [&](vtkIdType i, vtkIdType end) {
      for (; i < end; ++i)
      {
        this->Reaches[i] = fits[i].Reach;
      }
    });
    this->MedianReach = ParallelMedian(count, [this](vtkIdType i) { return this->Reaches[i]; });
    this->MedianSpacing = ParallelMedian(count, [&](vtkIdType i) { return fits[i].Spacing; });
  }

  /// The spacing that an isolated point gets; negative if the point is not isolated.
  float Spacing(int i, Neighbors& neighbors, std::vector<float>& scratch) const
  {
    const PlaneFit& fit = this->Fits[i];
    const bool isVerySparse = fit.Reach > this->Factor * this->Factor * this->MedianReach;
    const bool isSparse = (isVerySparse || this->IsSparse(fit)) && !this->IsOnSurface(i, neighbors);
    if (isSparse && isVerySparse)
    {
      return std::min(fit.Spacing, this->MedianSpacing);
    }
    if (!this->IsFar(i, scratch) && !this->IsAlone(i, scratch))
    {
      return isSparse ? std::min(fit.Spacing, this->LargestOfSparse()) : -1.0f;
    }
    this->Collect(i, scratch, [this](int j) { return this->Fits[j].Spacing; });
    return std::min(fit.Spacing, Median(scratch));
  }

private:
  bool IsSparse(const PlaneFit& fit) const
  {
    return fit.Reach > SparseFactors * this->Factor * this->MedianReach && fit.Flatness > NoPlane &&
      !fit.Given;
  }

  /// Lines are in no plane, whatever it is that they are on.
  bool IsOnSurface(int i, Neighbors& neighbors) const
  {
    return IsOnSparseSurface(i, this->Tree, this->Reaches, neighbors, [this](int j) {
      const PlaneFit& fit = this->Fits[j];
      return fit.Flatness < NoPlane && SpreadOf(fit.VarianceV, fit.VarianceU) == Spread::Round;
    });
  }

  float LargestOfSparse() const { return static_cast<float>(this->Factor) * this->MedianSpacing; }

  /// Of the nearest neighbours.
  template <class Function>
  void Collect(int i, std::vector<float>& values, const Function& function) const
  {
    values.clear();
    const int* ids = this->Graph.Row(i);
    for (int k = 0; k < ReachRank && ids[k] >= 0; ++k)
    {
      values.push_back(function(ids[k]));
    }
  }

  void CollectReaches(int i, std::vector<float>& reaches) const
  {
    this->Collect(i, reaches, [this](int j) { return this->Reaches[j]; });
  }

  /// Of the nearest neighbours; infinite without any.
  float LeastReachAround(int i) const
  {
    float least = std::numeric_limits<float>::infinity();
    const int* ids = this->Graph.Row(i);
    for (int k = 0; k < ReachRank && ids[k] >= 0; ++k)
    {
      least = std::min(least, this->Reaches[ids[k]]);
    }
    return least;
  }

  bool IsFar(int i, std::vector<float>& reaches) const
  {
    const float reach = this->Reaches[i];
    // Most reaches are below that of the smallest, and the median is not needed.
    if (!(reach > this->Factor * this->LeastReachAround(i)))
    {
      return false;
    }
    this->CollectReaches(i, reaches);
    return reach > this->Factor * Median(reaches);
  }

  bool IsAlone(int i, std::vector<float>& reaches) const
  {
    const int* ids = this->Graph.Row(i);
    const float reach = this->Reaches[i];
    if (!this->Graph.AreNearest || ids[0] < 0)
    {
      return false;
    }
    const double nearest = Norm(this->Way(ids[0], i));
    if (!(nearest > AloneShare * reach))
    {
      return false;
    }
    this->CollectReaches(i, reaches);
    return nearest > AlonePerFactor * this->Factor * Median(reaches) && this->IsOffPlanes(i);
  }

  /// Whether a point is off the planes of most neighbours: where a sparse part of a surface meets a
  /// dense one, it is not.
  bool IsOffPlanes(int i) const
  {
    const int* ids = this->Graph.Row(i);
    int off = 0;
    for (int k = 0; k < ReachRank && ids[k] >= 0; ++k)
    {
      const Vector3 way = this->Way(ids[k], i);
      off += 2.0 * std::abs(Dot(this->Fits[ids[k]].Normal, way)) > Norm(way) ? 1 : -1;
    }
    return off > 0;
  }

  Vector3 Way(int from, int to) const
  {
    const float *p = this->Cloud.Position(from), *q = this->Cloud.Position(to);
    return { static_cast<double>(q[0]) - p[0], static_cast<double>(q[1]) - p[1],
      static_cast<double>(q[2]) - p[2] };
  }

  const LocalCloud& Cloud;
  const NeighborSearch& Tree;
  const NeighborGraph& Graph;
  const PlaneFits& Fits;
  double Factor;
  RawVector<float> Reaches; // [n] of the fits, which are 13 times as large
  float MedianReach = 0.0f;
  float MedianSpacing = 0.0f;
};
}

void BoundIsolated(double factor, const SearchedCloud& searched, PlaneFits& fits)
{
  const int count = static_cast<int>(fits.size());
  const IsolationTest test(searched, fits, factor);
  RawVector<float> spacings(count); // first all tests, then all changes
  ParallelFor(0, count, [&](vtkIdType begin, vtkIdType end) {
    Neighbors neighbors;
    std::vector<float> scratch;
    for (vtkIdType i = begin; i < end; ++i)
    {
      spacings[i] = test.Spacing(static_cast<int>(i), neighbors, scratch);
    }
  });
  ParallelFor(0, count, [&](vtkIdType i, vtkIdType end) {
    for (; i < end; ++i)
    {
      if (spacings[i] >= 0.0f)
      {
        fits[i].Isolated = true;
        fits[i].MakeRound(spacings[i]);
      }
    }
  });
}
}
