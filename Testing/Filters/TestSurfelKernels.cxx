// SPDX-License-Identifier: BSD-3-Clause
// Normals, spacing and kernels on surfaces whose truth is known.
#include "SurfelTesting.h"

#include "vtkSurfelEstimation.h"

#include "vtkSmartPointer.h"

#include <algorithm>

using namespace SurfelTesting;

namespace
{
/// Angles between estimated and true normals, degrees, sorted. Signs do not matter.
std::vector<double> NormalErrors(const Surfels& surfels, const Sampled& truth)
{
  std::vector<double> errors;
  for (vtkIdType i = 0; i < surfels.Count(); ++i)
  {
    const double cosine = std::abs(Dot(surfels.Normal(i), truth.Normals[i]));
    errors.push_back(std::acos(std::min(cosine, 1.0)) * 180.0 / Pi);
  }
  std::sort(errors.begin(), errors.end());
  return errors;
}

TEST_CASE("Normals")
{
  const struct
  {
    Sampled Surface;
    double Median, Most; // degrees: at half and at 99 % of the points
  } cases[] = {
    { MakeSphere(2.0, 20000, Random(1)), 0.8, 2.5 },
    { MakeTube(0.1, 1.0, 0.02, false, Random(2)), 3.0, 16.0 },
    { MakeRectangle({ 0, 0, 1 }, { 1, 0, 0 }, 1, { 0, 0.6, 0.8 }, 1, 0.01, 1.0, Random(3)), 1e-3,
      1e-2 },
  };
  for (const auto& test : cases)
  {
    vtkNew<vtkSurfelEstimation> estimation;
    estimation->SetInputData(ToPolyData(test.Surface.Points));
    estimation->Update();
    const Surfels surfels(estimation->GetOutput());
    CHECK(surfels.HasArrays());
    CHECK(surfels.Count() == static_cast<vtkIdType>(test.Surface.Points.size()));
    const auto errors = NormalErrors(surfels, test.Surface);
    CHECK(AtShare(errors, 0.5) <= test.Median);
    CHECK(AtShare(errors, 0.99) <= test.Most);
  }
}

/// The area per point, and with it the radius, also on borders and corners.
TEST_CASE("Spacing")
{
  const double pitch = 0.01;
  const Sampled plane =
    MakeRectangle({ 0, 0, 0 }, { 1, 0, 0 }, 1, { 0, 1, 0 }, 1, pitch, 1.0, Random(4));
  vtkNew<vtkSurfelEstimation> estimation;
  estimation->SetInputData(ToPolyData(plane.Points));
  estimation->SetKernelModeToCircular(); // its area is the spacing's square
  estimation->Update();
  const Surfels surfels(estimation->GetOutput());
  CHECK_NEAR(estimation->GetMedianSpacing() / pitch, 1.0, 0.05);
  std::vector<double> inside, border;
  for (vtkIdType i = 0; i < surfels.Count(); ++i)
  {
    const Vec p = surfels.Position(i);
    const double edge = std::min({ p[0], p[1], 1.0 - p[0], 1.0 - p[1] });
    (edge < pitch ? border : inside).push_back(surfels.Area(i) / (pitch * pitch));
  }
  CHECK_NEAR(Spread(inside).Mean, 1.0, 0.1);
  CHECK(Spread(inside).Deviation <= 0.2);
  CHECK_NEAR(Spread(border).Mean, 1.0, 0.2);
  CHECK(Spread(border).Maximum <= 2.5);
}

/// Covariance: rank 2, in the plane of the normal, sigma = KernelScale spacing.
TEST_CASE("Circular kernels")
{
  const Sampled sphere = MakeSphere(1.0, 5000, Random(5));
  for (const double scale : { 0.5, 0.6, 1.0 })
  {
    vtkNew<vtkSurfelEstimation> estimation;
    estimation->SetInputData(ToPolyData(sphere.Points));
    estimation->SetKernelModeToCircular();
    estimation->SetKernelScale(scale);
    estimation->Update();
    const Surfels surfels(estimation->GetOutput());
    double worstTrace = 0.0, worstNormal = 0.0;
    for (vtkIdType i = 0; i < surfels.Count(); ++i)
    {
      const auto s = surfels.Covariance(i);
      const Vec n = surfels.Normal(i);
      const double variance = scale * scale * surfels.Area(i);
      worstTrace = std::max(worstTrace, std::abs((s[0] + s[1] + s[2]) / (2.0 * variance) - 1.0));
      const Vec along{ s[0] * n[0] + s[3] * n[1] + s[5] * n[2],
        s[3] * n[0] + s[1] * n[1] + s[4] * n[2], s[5] * n[0] + s[4] * n[1] + s[2] * n[2] };
      worstNormal = std::max(worstNormal, Length(along) / variance);
    }
    CHECK(worstTrace <= 1e-5);
    CHECK(worstNormal <= 1e-5);
  }
}

/// Larger over smaller standard deviation in the plane z = const, and the product's root.
void Axes(const std::array<double, 6>& s, double& ratio, double& sigma)
{
  const double mean = 0.5 * (s[0] + s[1]);
  const double half = std::hypot(0.5 * (s[0] - s[1]), s[3]);
  ratio = std::sqrt((mean + half) / std::max(mean - half, 1e-30));
  sigma = std::sqrt(std::sqrt((mean + half) * (mean - half)));
}

/// A strip three points wide: elliptical kernels stretch along it, of the same area as round
/// ones, up to the bound.
TEST_CASE("Elliptical kernels")
{
  const double pitch = 0.01;
  const Sampled strip =
    MakeRectangle({ 0, 0, 0 }, { 1, 0, 0 }, 1, { 0, 1, 0 }, 3 * pitch, pitch, 0.3, Random(6));
  for (const double bound : { 1.0, 1.5, 4.0 })
  {
    vtkNew<vtkSurfelEstimation> estimation;
    estimation->SetInputData(ToPolyData(strip.Points));
    estimation->SetKernelModeToElliptical();
    estimation->SetMaximumAxisRatio(bound);
    estimation->Update();
    const Surfels surfels(estimation->GetOutput());
    std::vector<double> ratios, sigmas;
    for (vtkIdType i = 0; i < surfels.Count(); ++i)
    {
      double ratio, sigma;
      Axes(surfels.Covariance(i), ratio, sigma);
      ratios.push_back(ratio);
      sigmas.push_back(sigma / std::sqrt(surfels.Area(i)));
    }
    CHECK(Spread(ratios).Maximum <= bound * 1.001);
    CHECK(Spread(ratios).Mean >= std::min(bound * 0.999, 1.5));
    CHECK_NEAR(Spread(sigmas).Minimum, 0.5, 1e-4);
    CHECK_NEAR(Spread(sigmas).Maximum, 0.5, 1e-4);
  }
}

/// On a regular grid a cell is a square of side d: area d^2, variance d^2 / 12 an axis, and the
/// blur; the surfel stays at its point.
TEST_CASE("Cells of grid")
{
  const double pitch = 0.01, blur = 0.3;
  const Sampled plane =
    MakeRectangle({ 0, 0, 0 }, { 1, 0, 0 }, 1, { 0, 1, 0 }, 1, pitch, 0.0, Random(21));
  vtkNew<vtkSurfelEstimation> estimation;
  estimation->SetInputData(ToPolyData(plane.Points));
  estimation->SetCellBlur(blur);
  estimation->Update();
  const double spacing = estimation->GetMedianSpacing();
  const double variance = pitch * pitch / 12.0 + blur * blur * spacing * spacing;
  const Surfels surfels(estimation->GetOutput());
  double worstArea = 0.0, worstVariance = 0.0, worstPlace = 0.0, total = 0.0;
  for (vtkIdType i = 0; i < surfels.Count(); ++i)
  {
    const Vec p = surfels.Position(i);
    total += surfels.Area(i);
    if (std::min({ p[0], p[1], 1.0 - p[0], 1.0 - p[1] }) < 3.0 * pitch)
    {
      continue;
    }
    const auto s = surfels.Covariance(i);
    worstArea = std::max(worstArea, std::abs(surfels.Area(i) / (pitch * pitch) - 1.0));
    // The blur follows the local spacing, which the choice among equally far neighbours sways.
    worstVariance =
      std::max({ worstVariance, std::abs(s[0] / variance - 1.0), std::abs(s[1] / variance - 1.0) });
    worstPlace = std::max(worstPlace, Length(Minus(p, plane.Points[i])) / pitch);
  }
  CHECK(worstArea <= 1e-4); // of coordinates with a rounding of 2^-24 / pitch
  CHECK(worstVariance <= 0.12);
  CHECK(worstPlace <= 1e-4);
  CHECK_NEAR(total, 1.0, 0.005);
}

/// Cells tile a surface whatever the sampling: their areas sum to its area, and their kernels to
/// nearly one before any normalization, where round kernels ripple three times as much.
TEST_CASE("Cells of random points")
{
  Sampled sphere, probes;
  Random random(22);
  for (int i = 0; i < 21000; ++i)
  {
    const Vec p = random.Direction();
    (i < 20000 ? sphere : probes).Add(p, p);
  }
  double deviation[2];
  for (const int mode : { vtkSurfelEstimation::CIRCULAR, vtkSurfelEstimation::CELL })
  {
    vtkNew<vtkSurfelEstimation> estimation;
    estimation->SetInputData(ToPolyData(sphere.Points));
    estimation->SetKernelMode(mode);
    estimation->Update();
    const Surfels surfels(estimation->GetOutput());
    std::vector<double> sums;
    for (size_t i = 0; i < probes.Points.size(); ++i)
    {
      sums.push_back(surfels.Sum(probes.Points[i], probes.Normals[i]));
    }
    deviation[mode == vtkSurfelEstimation::CELL] = Spread(sums).Deviation;
    if (mode == vtkSurfelEstimation::CELL)
    {
      CHECK_NEAR(surfels.TotalArea() / (4.0 * Pi), 1.0, 0.005);
      CHECK_NEAR(Spread(sums).Mean, 1.0, 0.02);
    }
  }
  CHECK(deviation[1] <= 0.16);
  CHECK(deviation[1] <= deviation[0] / 3.0);
}

/// Root of the mean square of the kernels' heights above a surface whose points were moved by some
/// along their normals. The normals are given.
double KernelHeights(const Sampled& surface, const std::vector<double>& heights)
{
  Sampled points = surface;
  for (size_t i = 0; i < points.Points.size(); ++i)
  {
    for (int c = 0; c < 3; ++c)
    {
      points.Points[i][c] += heights[i] * points.Normals[i][c];
    }
  }
  const vtkSmartPointer<vtkPolyData> scan = ToPolyData(points.Points);
  AddNormals(scan, points.Normals);
  vtkNew<vtkSurfelEstimation> estimation;
  estimation->SetInputData(scan);
  estimation->Update();
  const Surfels surfels(estimation->GetOutput());
  double sum = 0.0;
  for (vtkIdType i = 0; i < surfels.Count(); ++i)
  {
    const double height = Dot(Minus(surfels.Position(i), surface.Points[i]), surface.Normals[i]);
    sum += height * height;
  }
  return std::sqrt(sum / static_cast<double>(surfels.Count()));
}

/// Kernels lie on the surface of the normals: on a sphere in the tangent planes of the points, and
/// of noise a root of the number of neighbours is left.
TEST_CASE("Cells on the surface")
{
  const Sampled sphere = MakeSphere(1.0, 5000, Random(8));
  CHECK(KernelHeights(sphere, std::vector<double>(sphere.Points.size(), 0.0)) < 1e-6);
  const double pitch = 0.01, noise = 0.2 * pitch;
  const Sampled plane =
    MakeRectangle({ 0, 0, 0 }, { 1, 0, 0 }, 1, { 0, 1, 0 }, 1, pitch, 1.0, Random(4));
  std::vector<double> heights;
  Random random(9);
  for (size_t i = 0; i < plane.Points.size(); ++i)
  {
    heights.push_back(noise * std::sqrt(3.0) * (2.0 * random() - 1.0));
  }
  const double left = KernelHeights(plane, heights) / noise;
  CHECK(left > 0.15);
  CHECK(left < 0.3);
}

/// Scan lines six times as far apart as their points: cells reach from line to line.
TEST_CASE("Cells of scan lines")
{
  Sampled lines;
  for (int row = 0; row < 40; ++row)
  {
    for (int column = 0; column < 240; ++column)
    {
      lines.Add({ 0.01 * column, 0.06 * row, 0.0 }, { 0, 0, 1 });
    }
  }
  vtkNew<vtkSurfelEstimation> estimation;
  estimation->SetInputData(ToPolyData(lines.Points));
  estimation->SetMaximumAxisRatio(10.0);
  estimation->Update();
  const Surfels surfels(estimation->GetOutput());
  std::vector<double> areas;
  for (vtkIdType i = 0; i < surfels.Count(); ++i)
  {
    const Vec p = surfels.Position(i);
    const auto s = surfels.Covariance(i);
    if (p[0] > 0.5 && p[0] < 1.9 && p[1] > 0.3 && p[1] < 2.0)
    {
      areas.push_back(surfels.Area(i) / (0.01 * 0.06));
      CHECK(s[1] >= 0.06 * 0.06 / 12.0);
      CHECK(s[0] <= 0.25 * s[1]);
    }
  }
  CHECK_NEAR(Spread(areas).Minimum, 1.0, 0.01);
  CHECK_NEAR(Spread(areas).Maximum, 1.0, 0.01);
}

/// Neighbours within a radius, or as many nearest ones, agree; the bound on their number holds.
TEST_CASE("Radius mode")
{
  const double pitch = 0.01;
  const Sampled plane =
    MakeRectangle({ 0, 0, 0 }, { 1, 0, 0 }, 0.5, { 0, 1, 0 }, 0.5, pitch, 1.0, Random(7));
  for (const int bound : { 12, 128 })
  {
    for (const double radius : { 0.2 * pitch, 3.0 * pitch })
    {
      vtkNew<vtkSurfelEstimation> estimation;
      estimation->SetInputData(ToPolyData(plane.Points));
      estimation->SetNeighborhoodModeToRadius();
      estimation->SetRadius(radius);
      estimation->SetMaximumNumberOfNeighbors(bound);
      estimation->Update();
      const Surfels surfels(estimation->GetOutput());
      CHECK_NEAR(estimation->GetMedianSpacing() / pitch, 1.0, 0.15);
      CHECK(AtShare(NormalErrors(surfels, plane), 1.0) <= 0.1);
    }
  }
  vtkNew<vtkSurfelEstimation> estimation;
  Messages messages(estimation);
  estimation->SetInputData(ToPolyData(plane.Points));
  estimation->SetNeighborhoodModeToRadius();
  estimation->Update();
  REQUIRE(!messages.Errors.empty());
  CHECK(messages.Errors[0].find("Radius") != std::string::npos);
  CHECK(estimation->GetOutput()->GetNumberOfPoints() == 0);
}

/// Scan lines 6 times as far apart as their points: the normal is that of the surface, since
/// more neighbours are asked for where the nearest ones are a line.
TEST_CASE("Scan lines")
{
  Sampled lines;
  Random random(8);
  for (int row = 0; row < 40; ++row)
  {
    for (int column = 0; column < 240; ++column)
    {
      lines.Add({ 0.01 * (column + 0.2 * random()), 0.12 * row, 0.0 }, { 0, 0, 1 });
    }
  }
  vtkNew<vtkSurfelEstimation> estimation;
  estimation->SetInputData(ToPolyData(lines.Points));
  estimation->Update();
  const Surfels surfels(estimation->GetOutput());
  CHECK(AtShare(NormalErrors(surfels, lines), 0.99) <= 1.0);
  CHECK(estimation->GetNumberOfDegeneratePoints() == 0);
}

/// Given normals, with kernels perpendicular to them, decide the side; unusable ones are replaced.
/// They are kept where points agree. Where these have another slope, kernels follow the points.
TEST_CASE("Given normals")
{
  for (const double tilt : { 0.0, 0.3 })
  {
    Sampled sphere = MakeSphere(1.0, 4000, Random(9));
    for (Vec& n : sphere.Normals)
    {
      n = { -n[0], -n[1], -n[2] }; // nothing an estimate would find
    }
    auto data = ToPolyData(sphere.Points);
    std::vector<Vec> given = sphere.Normals;
    for (Vec& n : given)
    {
      n[2] += tilt;
      const double length = Length(n);
      n = { n[0] / length, n[1] / length, n[2] / length };
    }
    given[17] = { 0, 0, 0 };
    given[18] = { std::nan(""), 0, 1 };
    AddNormals(data, given);
    vtkNew<vtkSurfelEstimation> estimation;
    Messages messages(estimation);
    estimation->SetInputData(data);
    estimation->Update();
    const Surfels surfels(estimation->GetOutput());
    CHECK(estimation->GetNumberOfInvalidNormals() == 2);
    CHECK(messages.Warnings.size() == 1);
    CHECK(messages.Errors.empty());
    CHECK(surfels.IsFinite());
    double worst = 0.0, worstKernel = 0.0;
    for (vtkIdType i = 0; i < surfels.Count(); ++i)
    {
      const Vec n = surfels.Normal(i);
      const auto s = surfels.Covariance(i);
      worstKernel = std::max(worstKernel,
        std::abs(s[0] * n[0] * n[0] + s[1] * n[1] * n[1] + s[2] * n[2] * n[2] +
          2.0 * (s[3] * n[0] * n[1] + s[4] * n[1] * n[2] + s[5] * n[0] * n[2])) /
          (s[0] + s[1] + s[2]));
      worst = i == 17 || i == 18 ? worst : std::max(worst, 1.0 - Dot(n, sphere.Normals[i]));
    }
    INFO(tilt, ": ", worst);
    CHECK(worst <= (tilt == 0.0 ? 1e-6 : 1e-3)); // of 0.045, 17 degrees
    CHECK(worstKernel <= 1e-5);
    CHECK(estimation->GetNumberOfTwoSidedSurfels() <= 2);
    CHECK(Dot(surfels.Normal(17), sphere.Normals[17]) >= 0.5); // follows its neighbours

    estimation->KeepNormalsOff();
    estimation->Update();
    CHECK(Dot(Surfels(estimation->GetOutput()).Normal(100), sphere.Normals[100]) <= -0.99);
  }
}
}
