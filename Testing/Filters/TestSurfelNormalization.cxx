// SPDX-License-Identifier: BSD-3-Clause
// Weights: the kernels sum to one over known surfaces, measured apart from the filter, and the
// total area is the surface's.
#include "SurfelTesting.h"

#include "vtkSurfelEstimation.h"
#include "vtkSurfelNormalization.h"

using namespace SurfelTesting;

namespace
{
struct Pipeline
{
  vtkNew<vtkSurfelEstimation> Estimation;
  vtkNew<vtkSurfelNormalization> Normalization;

  explicit Pipeline(const Sampled& surface)
  {
    this->Estimation->SetInputData(ToPolyData(surface.Points));
    this->Normalization->SetInputConnection(this->Estimation->GetOutputPort());
  }
  Surfels Run()
  {
    this->Normalization->Update();
    return Surfels(this->Normalization->GetOutput());
  }
};

/// Sums at every `stride`-th of points of the surface that are not surfels.
Spread SumsOver(const Surfels& surfels, const Sampled& probes, size_t stride)
{
  std::vector<double> sums;
  for (size_t i = 0; i < probes.Points.size(); i += stride)
  {
    sums.push_back(surfels.Sum(probes.Points[i], probes.Normals[i]));
  }
  return Spread(sums);
}

TEST_CASE("Closed surfaces")
{
  const struct
  {
    Sampled Surface, Probes;
    double Area, AreaTolerance;
  } cases[] = {
    { MakeSphere(1.0, 20000, Random(1)), MakeSphere(1.0, 30011, Random(2)), 4.0 * Pi, 0.01 },
    { MakeTube(0.1, 1.0, 0.015, true, Random(3)), MakeTube(0.1, 1.0, 0.011, false, Random(4)),
      2.0 * Pi * 0.1 * (1.0 + 0.1), 0.02 },
    { MakeBox(1.0, 0.7, 0.4, 0.02, Random(5)), MakeBox(1.0, 0.7, 0.4, 0.017, Random(6)),
      2.0 * (0.7 + 0.4 + 0.28), 0.03 },
  };
  for (const auto& test : cases)
  {
    for (const int mode : { vtkSurfelEstimation::CIRCULAR, vtkSurfelEstimation::CELL })
    {
      Pipeline pipeline(test.Surface);
      pipeline.Estimation->SetKernelMode(mode);
      const Surfels surfels = pipeline.Run();
      CHECK_NEAR(surfels.TotalArea() / test.Area, 1.0, test.AreaTolerance);
      const Spread before = SumsOver(Surfels(pipeline.Estimation->GetOutput()), test.Probes, 30);
      const Spread after = SumsOver(surfels, test.Probes, 30);
      CHECK_NEAR(after.Mean, 1.0, 0.02);
      // Cells leave little to normalize: no more than what 16 samples a surfel can tell from noise,
      // a tenth. What remains are edges of the box, where kernels of one face stand off the other.
      const bool cells = mode == vtkSurfelEstimation::CELL;
      CHECK(after.Deviation <= (cells ? 1.1 : 0.8) * before.Deviation);
      CHECK(after.Deviation <= (cells ? 0.16 : 0.25));
    }
  }
}

/// A square: its total area, the sum inside, and no excess on the border.
TEST_CASE("Borders")
{
  for (const double jitter : { 0.0, 1.0 })
  {
    const double pitch = 0.01;
    const Sampled plane =
      MakeRectangle({ 0, 0, 0 }, { 1, 0, 0 }, 1, { 0, 1, 0 }, 1, pitch, jitter, Random(7));
    Pipeline pipeline(plane);
    const Surfels surfels = pipeline.Run();
    CHECK_NEAR(surfels.TotalArea(), 1.0, 0.01);
    const Spread inside = SumsOver(surfels,
      MakeRectangle({ .05, .05, 0 }, { 1, 0, 0 }, .9, { 0, 1, 0 }, .9, 0.03, 1.0, Random(8)), 1);
    CHECK_NEAR(inside.Mean, 1.0, 0.02);
    const Spread border = SumsOver(surfels,
      MakeRectangle({ 0, 0, 0 }, { 1, 0, 0 }, 1, { 0, 1, 0 }, pitch, 0.005, 1.0, Random(9)), 1);
    CHECK_NEAR(border.Mean, 0.9, 0.2);
    CHECK(border.Maximum <= 2.0);
    double largest = 0.0;
    for (vtkIdType i = 0; i < surfels.Count(); ++i)
    {
      largest = std::max(largest, surfels.Area(i) / (pitch * pitch));
    }
    CHECK(largest <= 4.0);
  }
}

/// Two sheets half a spacing apart that face away from each other, and two that cross: each
/// keeps its own area.
TEST_CASE("Sheets")
{
  Sampled sheets =
    MakeRectangle({ 0, 0, 0 }, { 1, 0, 0 }, 1, { 0, 1, 0 }, 1, 0.01, 1.0, Random(10));
  sheets.Append(
    MakeRectangle({ 0, 0, -0.005 }, { 0, 1, 0 }, 1, { 1, 0, 0 }, 1, 0.01, 1.0, Random(11)));
  auto data = ToPolyData(sheets.Points);
  AddNormals(data, sheets.Normals);
  Pipeline pipeline(sheets);
  pipeline.Estimation->SetInputData(data);
  CHECK_NEAR(pipeline.Run().TotalArea(), 2.0, 0.03);

  Sampled crossing =
    MakeRectangle({ 0, 0, 0 }, { 1, 0, 0 }, 1, { 0, 1, 0 }, 1, 0.01, 1.0, Random(12));
  crossing.Append(
    MakeRectangle({ 0.5, 0, -0.5 }, { 0, 1, 0 }, 1, { 0, 0, 1 }, 1, 0.01, 1.0, Random(13)));
  Pipeline second(crossing);
  CHECK_NEAR(second.Run().TotalArea(), 2.0, 0.03);
}

/// The report, the bounds, and settings that must not matter much.
TEST_CASE("Settings")
{
  const Sampled sphere = MakeSphere(1.0, 10000, Random(14));
  Pipeline pipeline(sphere);
  pipeline.Run();
  vtkSurfelNormalization* filter = pipeline.Normalization;
  CHECK_NEAR(filter->GetMeanAfter(), 1.0, 0.01);
  CHECK((filter->GetStandardDeviationAfter()) <= (filter->GetStandardDeviationBefore()));
  CHECK_NEAR(filter->GetTotalAreaAfter(), 4.0 * Pi, 0.15);
  CHECK(filter->GetNumberOfSamples() > 10000);
  CHECK(filter->GetMinimumAfter() > 0.0);
  CHECK(filter->GetMaximumAfter() < 3.0);
  const double area = filter->GetTotalAreaAfter();
  filter->SetSupport(3.5);
  pipeline.Run();
  CHECK_NEAR(filter->GetTotalAreaAfter() / area, 1.0, 0.005);
  filter->SetSupport(4.0);

  filter->SetMinimumFactor(0.95);
  filter->SetMaximumFactor(1.05);
  const Surfels bounded = pipeline.Run();
  const Surfels start(pipeline.Estimation->GetOutput());
  double lowest = 1.0, highest = 1.0;
  for (vtkIdType i = 0; i < bounded.Count(); ++i)
  {
    lowest = std::min(lowest, bounded.Area(i) / start.Area(i));
    highest = std::max(highest, bounded.Area(i) / start.Area(i));
  }
  CHECK(lowest >= 0.95 - 1e-5);
  CHECK(highest <= 1.05 + 1e-5);

  filter->SetNumberOfIterations(0);
  CHECK_NEAR(pipeline.Run().TotalArea(), start.TotalArea(), 1e-6 * start.TotalArea());
  CHECK(filter->GetMeanBefore() == filter->GetMeanAfter());
}

/// Input that is no surfel cloud, an empty one, and surfels with faults.
TEST_CASE("Trouble")
{
  vtkNew<vtkSurfelNormalization> filter;
  Messages messages(filter);
  filter->SetInputData(ToPolyData(MakeSphere(1.0, 100, Random(15)).Points));
  filter->Update();
  REQUIRE(!messages.Errors.empty());
  CHECK(messages.Errors[0].find("SurfelCovariance") != std::string::npos);

  Pipeline empty{ Sampled() };
  CHECK(empty.Run().Count() == 0);
  CHECK(empty.Run().HasArrays());

  Sampled lone;
  lone.Points = { { 1.0, 2.0, 3.0 } };
  Pipeline point(lone);
  point.Estimation->Update();
  CHECK_NEAR(
    point.Run().Area(0), Surfels(point.Estimation->GetOutput()).Area(0), 0.0); // left as it was

  Sampled sphere = MakeSphere(1.0, 5000, Random(16));
  Pipeline pipeline(sphere);
  pipeline.Estimation->Update();
  vtkNew<vtkPolyData> faulty;
  faulty->DeepCopy(pipeline.Estimation->GetOutput());
  vtkPointData* arrays = faulty->GetPointData();
  const double zero[6] = {};
  arrays->GetArray("SurfelAreaVector")->SetTuple(7, zero);
  arrays->GetArray("SurfelCovariance")->SetTuple(8, zero);
  arrays->GetArray("SurfelAreaVector")->SetComponent(9, 1, std::nan(""));
  faulty->GetPoints()->SetPoint(10, faulty->GetPoint(11));
  faulty->GetPoints()->SetPoint(12, std::nan(""), 0, 0);
  messages.Errors.clear();
  filter->SetInputData(faulty);
  filter->Update();
  CHECK(messages.Errors.empty());
  CHECK(messages.Warnings.size() == 1);
  CHECK(filter->GetNumberOfUnusableSurfels() == 4);
  CHECK(filter->GetNumberOfDuplicateSurfels() == 1);
  CHECK_NEAR(filter->GetMeanAfter(), 1.0, 0.01);
  CHECK(Surfels(filter->GetOutput()).Area(11) == 0.0);
}

/// Arrays that do not have a value for every point are refused before they are read.
/// Kernels whose peak, 1 / area, is beyond floats: left as they are, and counted.
TEST_CASE("Tiny surfels")
{
  vtkNew<vtkSurfelEstimation> estimation;
  estimation->SetInputData(ToPolyData(MakeSphere(1.0, 200, Random(9)).Points));
  estimation->Update();
  vtkNew<vtkPolyData> tiny;
  tiny->DeepCopy(estimation->GetOutput());
  vtkDataArray* covariances = tiny->GetPointData()->GetArray("SurfelCovariance");
  for (vtkIdType i = 0; i < covariances->GetNumberOfTuples(); ++i)
  {
    for (int c = 0; c < 6; ++c)
    {
      covariances->SetComponent(i, c, 1e-38 * covariances->GetComponent(i, c));
    }
  }
  vtkNew<vtkSurfelNormalization> filter;
  filter->SetInputData(tiny);
  Messages messages(filter);
  filter->Update();
  CHECK(filter->GetNumberOfUnusableSurfels() == 200);
  CHECK(messages.Errors.empty());
  vtkDataArray* before = tiny->GetPointData()->GetArray("SurfelAreaVector");
  vtkDataArray* after = filter->GetOutput()->GetPointData()->GetArray("SurfelAreaVector");
  for (vtkIdType i = 0; i < before->GetNumberOfTuples(); ++i)
  {
    CHECK_NEAR(after->GetComponent(i, 0), before->GetComponent(i, 0), 0.0);
  }
}

/// The mean overlap of the surfels farther than `margin` from the border of the unit square.
/// @param from,to only of those with a z in between
double MeanOverlap(vtkPolyData* surfels, double margin, double from = -1.0, double to = 1.0)
{
  vtkDataArray* overlaps = surfels->GetPointData()->GetArray("SurfelOverlap");
  double sum = 0.0;
  int count = 0;
  for (vtkIdType i = 0; i < surfels->GetNumberOfPoints(); ++i)
  {
    const Vec p = Surfels(surfels).Position(i);
    const bool isInside = std::min(p[0], p[1]) > margin && std::max(p[0], p[1]) < 1.0 - margin &&
      p[2] > from && p[2] < to;
    sum += isInside ? overlaps->GetTuple1(i) / 255.0 : 0.0;
    count += isInside ? 1 : 0;
  }
  return sum / count;
}

/// Of two sheets that face the same way, a few kernels apart, the one in front covers the other;
/// those that are far from one another or face away do not, and no smooth sheet covers itself.
TEST_CASE("Overlap")
{
  const struct
  {
    double Distance, Overlap;
    bool FacesAway;
  } cases[] = { { 0.012, 0.5, false }, { 0.03, 0.0, false }, { 0.012, 0.0, true } };
  for (const auto& test : cases)
  {
    const Vec u{ 1, 0, 0 }, v{ 0, 1, 0 };
    Sampled sheets = MakeRectangle({ 0, 0, 0 }, u, 1, v, 1, 0.01, 1.0, Random(40));
    sheets.Append(MakeRectangle({ 0, 0, -test.Distance }, test.FacesAway ? v : u, 1,
      test.FacesAway ? u : v, 1, 0.01, 1.0, Random(41)));
    auto data = ToPolyData(sheets.Points);
    AddNormals(data, sheets.Normals);
    Pipeline pipeline(sheets);
    pipeline.Estimation->SetInputData(data);
    CHECK_NEAR(pipeline.Run().TotalArea(), 2.0, 0.05); // in focus each covers what it covers
    vtkPolyData* surfels = pipeline.Normalization->GetOutput();
    const double middle = -0.5 * test.Distance;
    CHECK(MeanOverlap(surfels, 0.05, middle) < 0.002);
    CHECK_NEAR(MeanOverlap(surfels, 0.05, -1.0, middle), 2.0 * test.Overlap,
      test.Overlap > 0.0 ? 0.1 : 0.002);
  }
  // Layers of noise fill the space between the foremost and the last, and none of them is in front.
  Sampled noise = MakeRectangle({ 0, 0, 0 }, { 1, 0, 0 }, 1, { 0, 1, 0 }, 1, 0.01, 1.0, Random(45));
  Random random(46);
  for (Vec& p : noise.Points)
  {
    p[2] += random.Uniform(-0.02, 0.02);
  }
  auto layers = ToPolyData(noise.Points);
  AddNormals(layers, noise.Normals);
  Pipeline rough(noise);
  rough.Estimation->SetInputData(layers);
  rough.Run();
  const double foremost = MeanOverlap(rough.Normalization->GetOutput(), 0.05, 0.01);
  CHECK(foremost > 0.15);
  CHECK_NEAR(MeanOverlap(rough.Normalization->GetOutput(), 0.05, -1.0, -0.01), foremost, 0.1);
  // A roof whose sides face 60 degrees apart: at its ridge they do not cover one another.
  Sampled roof = MakeRectangle({ 0, 0, 0 }, { 1, 0, 0 }, 1, { 0, 1, 0 }, 1, 0.01, 1.0, Random(43));
  roof.Append(
    MakeRectangle({ 0, 0, 0 }, { 0, -0.5, -0.866 }, 0.2, { 1, 0, 0 }, 1, 0.01, 1.0, Random(44)));
  auto points = ToPolyData(roof.Points);
  AddNormals(points, roof.Normals);
  Pipeline ridge(roof);
  ridge.Estimation->SetInputData(points);
  ridge.Run();
  CHECK(MeanOverlap(ridge.Normalization->GetOutput(), -1.0) <= 0.001);
  Pipeline sphere(MakeSphere(1.0, 20000, Random(42)));
  sphere.Run();
  vtkPolyData* surfels = sphere.Normalization->GetOutput();
  CHECK(surfels->GetPointData()->GetArray("SurfelOverlap")->GetRange()[1] == 0.0);
}

TEST_CASE("Short arrays")
{
  Pipeline pipeline(MakeSphere(1.0, 500, Random(17)));
  pipeline.Estimation->Update();
  vtkNew<vtkSurfelNormalization> filter;
  Messages messages(filter);
  for (const char* name :
    { "SurfelAreaVector", "SurfelCovariance", "SurfelTwoSided", "SurfelOverlap" })
  {
    vtkNew<vtkPolyData> surfels;
    surfels->DeepCopy(pipeline.Estimation->GetOutput());
    surfels->GetPointData()->GetArray(name)->SetNumberOfTuples(10);
    messages.Errors.clear();
    filter->SetInputData(surfels);
    filter->Update();
    REQUIRE(!messages.Errors.empty());
    CHECK(messages.Errors[0].find(name) != std::string::npos);
  }

  // Normals that are too few are no normals: they are estimated.
  Sampled sphere = MakeSphere(1.0, 500, Random(18));
  vtkSmartPointer<vtkPolyData> points = ToPolyData(sphere.Points);
  AddNormals(points, sphere.Normals);
  points->GetPointData()->GetNormals()->SetNumberOfTuples(10);
  vtkNew<vtkSurfelEstimation> estimation;
  estimation->SetInputData(points);
  estimation->Update();
  CHECK(Surfels(estimation->GetOutput()).Count() == 500);
  CHECK(Surfels(estimation->GetOutput()).IsFinite());
}
}
