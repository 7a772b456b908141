// SPDX-License-Identifier: BSD-3-Clause
#include "Filters/Cleaning/ScanRegistration.h"

#include "Filters/Arrays/PointColors.h"
#include "Filters/Cleaning/CleaningProblem.h"
#include "Filters/Cleaning/LocalQuadric.h"
#include "Filters/Cleaning/ScanSplit.h"
#include "Filters/Common/Median.h"
#include "Filters/Neighbors/NeighborSearch.h"

#include <Eigen/Dense>

#include <algorithm>
#include <cmath>

namespace SurfelGeometry
{
namespace
{
/// Samples of the whole cloud. Those that tell where the second scan begins have some 64 neighbours
/// each: up to half a million points, its first one is exact.
constexpr double Samples = 8192.0;

/// The share of the sides' variance that the order of the points must explain. At random it
/// explains a 64th.
constexpr double LeastExplained = 0.15;

/// The least share of the samples of the second scan that have the first one about them.
constexpr double LeastOverlap = 0.2;

/// Translations along an axis are known from normals if the mean of (n . axis)^2 is LeastSpread,
/// from shades if the mean square of their change in a spacing is LeastContrast times that of what
/// is left of their differences. Noise alone has 0.008 there, 1 / (8 pi w^4) for ShadeWidth w;
/// patterns have 0.06 to 0.4.
constexpr double LeastSpread = 0.02;
constexpr double LeastContrast = 0.03;

/// Motions of which less than this part of it is known stay zero; rotations have short arms.
constexpr double LeastKnown = 0.05;

/// What is left after the motion must be at most this many times what the first scan has from its
/// own surface, plus the residual of the fits; before it, distances must be LeastGain times as
/// large.
constexpr double LargestRest = 1.5;
constexpr double LeastGain = 1.25;

/// Shades that differ by less are equal: the noise of colours of 8 bits.
constexpr double ShadeNoise = 4.0;

/// The second scan's center moves by this many spacings at most: the fits reach no farther.
constexpr double LargestMotion = 4.0;

/// Tukey's biweight is 0 beyond this many standard deviations; 1.4826 medians of the absolute value
/// are one.
constexpr double TukeyReach = 4.685;
constexpr double DeviationPerMedian = 1.4826;

constexpr int MostSteps = 30;
constexpr double LastStep = 1e-3; // spacings

/// Points of two scans nearer than this part of the spacing are the same one, looked for among the
/// nearest ones.
constexpr double TwinDistance = 0.1;
constexpr int TwinNeighbors = 16;

using Vector6 = Eigen::Matrix<double, 6, 1>;
using Matrix6 = Eigen::Matrix<double, 6, 6>;

Eigen::Vector3d ToEigen(const Vector3& a)
{
  return { a[0], a[1], a[2] };
}

/// What the distances of some samples are like.
struct DistanceStatistics
{
  Vector3 Center = { 0.0, 0.0, 0.0 }; // mean place
  double Radius = 0.0;                // mean distance from the center
  double Spacing = 0.0;               // mean
  double Height = 0.0;                // median of the absolute heights, spacings
  double Shade = 0.0;                 // root mean square of the differences

  explicit DistanceStatistics(const std::vector<ScanDistance>& distances)
  {
    const double share = 1.0 / std::max<double>(1.0, static_cast<double>(distances.size()));
    std::vector<double> heights;
    double squares = 0.0;
    for (const ScanDistance& d : distances)
    {
      this->Center = this->Center + share * Load(d.Place);
      this->Spacing += share * d.Spacing;
      heights.push_back(std::abs(d.Height) / d.Spacing);
      squares += share * d.Shade * d.Shade;
    }
    for (const ScanDistance& d : distances)
    {
      this->Radius += share * Norm(Load(d.Place) - this->Center);
    }
    this->Height = Median(heights);
    this->Shade = std::sqrt(squares);
  }
};

/// One step of Gauss and Newton: shift (spacings) and rotation (times radius over spacing).
class MotionStep
{
public:
  /// Rotations are about the statistics' center.
  MotionStep(const std::vector<ScanDistance>& distances, const DistanceStatistics& usual)
  {
    const double height = std::max(CleanResidual, DeviationPerMedian * usual.Height);
    const double shade = std::max(ShadeNoise, usual.Shade);
    for (const ScanDistance& d : distances)
    {
      const double part = d.Height / (TukeyReach * height * d.Spacing);
      const double weight = std::abs(part) < 1.0 ? std::pow(1.0 - part * part, 2) : 0.0;
      const Eigen::Vector3d arm = ToEigen(Load(d.Place) - usual.Center) / usual.Radius;
      const Vector6 row = RowOf(ToEigen(Load(d.Normal)), arm);
      this->Add(row, d.Height / usual.Spacing, weight / (height * height), weight / LeastSpread);
      // Where the heights fit no surface, shades are not compared.
      const Vector6 shades = RowOf(usual.Spacing / shade * ToEigen(Load(d.Gradient)), arm);
      this->Add(shades, -d.Shade / shade, weight, weight / LeastContrast);
      this->Weight += weight;
    }
  }

  /// Whether normals or shades tell about translations in all directions.
  bool IsKnown() const
  {
    return Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(this->Known.topLeftCorner<3, 3>())
             .eigenvalues()[0] >= this->Weight;
  }

  /// Motions that hardly change the distances stay zero.
  Vector6 Solve() const
  {
    const Eigen::SelfAdjointEigenSolver<Matrix6> solver(this->Known);
    Matrix6 axes = solver.eigenvectors(), normals = Matrix6::Zero();
    for (int i = 0; i < 6; ++i)
    {
      if (solver.eigenvalues()[i] <= LeastKnown * this->Weight)
      {
        axes.col(i).setZero();
        normals(i, i) = 1.0;
      }
    }
    normals += axes.transpose() * this->Normals * axes;
    return axes * normals.llt().solve(axes.transpose() * this->Right);
  }

private:
  static Vector6 RowOf(const Eigen::Vector3d& slope, const Eigen::Vector3d& arm)
  {
    Vector6 row;
    row << slope, arm.cross(slope);
    return row;
  }

  /// One equation: the motion must change the distance by -residual.
  void Add(const Vector6& row, double residual, double weight, double known)
  {
    this->Normals += weight * row * row.transpose();
    this->Right -= weight * residual * row;
    this->Known += known * row * row.transpose();
  }

  Matrix6 Normals = Matrix6::Zero();
  Vector6 Right = Vector6::Zero();
  Matrix6 Known = Matrix6::Zero(); // 1 along axes of which just enough is known
  double Weight = 0.0;
};

/// Appends a shift of the center, world units, and a rotation vector.
void Append(const Eigen::Vector3d& shift, const Eigen::Vector3d& turn, ScanMotion& motion)
{
  Eigen::Matrix3d rotation;
  for (int r = 0; r < 3; ++r)
  {
    rotation.row(r) = ToEigen(motion.Rotation[r]).transpose();
  }
  const double angle = turn.norm();
  if (angle > 0.0)
  {
    rotation = Eigen::AngleAxisd(angle, turn / angle).toRotationMatrix() * rotation;
  }
  for (int r = 0; r < 3; ++r)
  {
    motion.Rotation[r] = { rotation(r, 0), rotation(r, 1), rotation(r, 2) };
    motion.Shift[r] += shift[r];
  }
}

/// Collective: moves the second scan.
/// @param isKnown whether the distances tell about motions in all directions
/// Returns false if stopped.
bool Fit(const ScanFits& fits, const StageProgress& progress, ScanMotion& motion,
  std::vector<ScanDistance>& distances, bool& isKnown)
{
  for (int step = 0; step < MostSteps; ++step)
  {
    const DistanceStatistics now(distances);
    if (now.Radius == 0.0 || now.Spacing == 0.0)
    {
      isKnown = false;
      return true;
    }
    const MotionStep next(distances, now);
    isKnown = next.IsKnown();
    const Vector6 change = next.Solve();
    if (step == 0)
    {
      motion.Center = now.Center;
    }
    // The rotation is about the center of the moved samples, which is a little off the moved one.
    const Eigen::Vector3d turn = now.Spacing / now.Radius * change.tail<3>();
    const Eigen::Vector3d arm = ToEigen(motion.Center + motion.Shift - now.Center);
    Append(now.Spacing * change.head<3>() + turn.cross(arm), turn, motion);
    if (!fits.Measure(progress.Step(1.0 * step / MostSteps), motion, distances))
    {
      return false;
    }
    if (change.norm() < LastStep)
    {
      break;
    }
  }
  return true;
}
}

bool FindSecondScan(const CleaningProblem& problem, vtkPointSet* input,
  const StageProgress& progress, std::optional<ScanMotion>& motion)
{
  motion.reset();
  const SampledColors colors{ FindColors(input), problem.Cloud() };
  const std::vector<int> samples =
    problem.Samples(Samples / std::max(Samples, 1.0 * problem.Total()));
  ScanSplit split;
  if (!FindScanSplit(problem, samples, colors, progress.Step(0.0), split))
  {
    return false;
  }
  if (split.Explained < LeastExplained)
  {
    return true;
  }
  ScanMotion found{ split.First, {}, {},
    { { 1.0, 0.0, 0.0 }, { 0.0, 1.0, 0.0 }, { 0.0, 0.0, 1.0 } } };
  const ScanFits fits(problem, colors, samples, split.First, true);
  std::vector<ScanDistance> own, distances;
  std::vector<float> second = { static_cast<float>(std::count_if(samples.begin(), samples.end(),
    [&](int i) { return problem.Cloud().SampleId(i) >= split.First; })) };
  if (!ScanFits(problem, colors, samples, split.First, false)
         .Measure(progress.Step(0.4), found, own) ||
    !problem.Gather(true, second) || !fits.Measure(true, found, distances))
  {
    return false;
  }
  double all = 0.0;
  for (const float some : second)
  {
    all += some;
  }
  if (static_cast<double>(distances.size()) < LeastOverlap * all)
  {
    return true;
  }
  const DistanceStatistics before(distances), usual(own);
  bool isKnown = false;
  if (!Fit(fits, progress.Part(0.5, 1.0), found, distances, isKnown))
  {
    return false;
  }
  const DistanceStatistics after(distances);
  const bool fitsWell = after.Height <= LargestRest * usual.Height + CleanResidual / 3 &&
    after.Shade <= LargestRest * usual.Shade + ShadeNoise &&
    before.Height >= LeastGain * after.Height;
  if (fitsWell && isKnown && Norm(found.Shift) <= LargestMotion * after.Spacing)
  {
    motion = found;
  }
  return true;
}

bool FindTwins(const CleaningProblem& problem, vtkIdType first, const StageProgress& progress,
  std::vector<unsigned char>& twins)
{
  const LocalCloud& cloud = problem.Cloud();
  twins.assign(cloud.Size(), 0);
  return ParallelFor(cloud.Size(), progress, [&](vtkIdType begin, vtkIdType end) {
    Neighbors neighbors;
    for (int i = static_cast<int>(begin); i < end; ++i)
    {
      if (cloud.SampleId(i) < first)
      {
        continue;
      }
      problem.Searched.Tree->FindNearest(i, TwinNeighbors, neighbors);
      const double reach =
        neighbors.Count() > 0 ? TwinDistance * SpacingOf(neighbors) * std::sqrt(2.0) : 0.0;
      for (int k = 0; k < neighbors.Count(); ++k)
      {
        const bool isNear = neighbors.SquaredDistances[k] <= reach * reach;
        twins[i] |= isNear && cloud.SampleId(neighbors.Ids[k]) < first ? 1 : 0;
      }
    }
  });
}
}
