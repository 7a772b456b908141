// SPDX-License-Identifier: BSD-3-Clause
// Volumes and particles as Gaussians, against closed forms: mass, optical depth, place, tiling.
#include "Testing/Shared/Random.h"
#include "VolumeTesting.h"

#include "vtkDataSetAttributes.h"
#include "vtkMatrix3x3.h"
#include "vtkSMPTools.h"
#include "vtkUnsignedCharArray.h"

#include <cstring>
#include <limits>

using namespace SurfelTesting;

namespace
{
TEST_CASE("A homogeneous slab has the optical depth of its thickness")
{
  const double s = Extinction(0.3, 0.7);
  auto image = MakeImage(17, 17, 9, [](int, int, int) { return 0.5; });
  image->SetSpacing(1.0, 1.5, 0.8);
  Run run(image, MakeProperty({ { 0.0, 0.3 } }, 0.7));
  const Gaussians gaussians = run.Result();
  CHECK(gaussians.Count() == 16 * 16 * 8); // homogeneous cells are not split
  CHECK_NEAR(gaussians.TotalMass(), s * 16 * 24 * 6.4, 1e-5 * s * 16 * 24 * 6.4);

  // Along an axis, the ripple of the two others: (1 + 2 exp(-pi^2 / 2))^2 = 1.029 at the centre of
  // a cell. The mean over a cell is exact.
  const double tau = s * 6.4;
  double mean = 0.0;
  for (int i = 0; i < 64; ++i)
  {
    const double depth = gaussians.OpticalDepth(
      { 8 + (i % 8 + 0.5) / 8, 12 + 1.5 * (i / 8 + 0.5) / 8, 0 }, { 0, 0, 1 });
    CHECK_NEAR(depth, tau, 0.03 * tau);
    mean += depth / 64;
  }
  CHECK_NEAR(mean, tau, 1e-4 * tau);
  CHECK_NEAR(gaussians.OpticalDepth({ 8.5, 12.75, 0 }, { 0, 0, 1 }), 1.029 * tau, 0.001 * tau);

  // Along a slanted line, which meets all parts of the cells: little ripple is left.
  const Vec slanted{ 0.31, 0.47, 1.0 };
  CHECK_NEAR(gaussians.OpticalDepth({ 7, 10.5, 0 }, slanted), tau * Length(slanted),
    0.005 * tau * Length(slanted));
}

TEST_CASE("The kernels add up to 1 within the ripple")
{
  const double s = Extinction(0.5, 1.0), ripple = 2.0 * std::exp(-0.5 * Pi * Pi);
  Run run(
    MakeImage(12, 12, 12, [](int, int, int) { return 1.0; }), MakeProperty({ { 0, 0.5 } }, 1));
  const Gaussians gaussians = run.Result();
  Random random(1);
  for (int i = 0; i < 100; ++i)
  {
    const double sum = gaussians.Sum({ 5 + random(), 5 + random(), 5 + random() }) / s;
    CHECK(sum < std::pow(1.0 + ripple, 3) + 1e-4);
    CHECK(sum > std::pow(1.0 - ripple, 3) - 1e-4);
  }
  // Both bounds are reached: at the centre of a cell, and at its corner.
  CHECK_NEAR(gaussians.Sum({ 5.5, 5.5, 5.5 }), s * std::pow(1.0 + ripple, 3), 1e-4);
  CHECK_NEAR(gaussians.Sum({ 5, 5, 5 }), s * std::pow(1.0 - ripple, 3), 1e-4);
}

TEST_CASE("Spacing, direction and origin count")
{
  const auto image = MakeTurnedImage(4);
  Run run(image, MakeProperty({ { 0.0, 0.5 } }, 1.0));
  const Gaussians gaussians = run.Result();
  REQUIRE(gaussians.Count() == 27);
  const double cell[3] = { 0.5, 1.0, 2.0 };
  for (vtkIdType i = 0; i < 27; ++i)
  {
    const double index[3] = { i % 3 + 0.5, i / 3 % 3 + 0.5, i / 9 + 0.5 };
    Vec place;
    image->TransformContinuousIndexToPhysicalPoint(index, place.data());
    CHECK(Length(Minus(gaussians.Position(i), place)) < 1e-6);
    // S = sum over the axes a of (spacing / 2)^2 a a^T
    double expected[3][3] = {};
    for (int k = 0; k < 9; ++k)
    {
      for (int axis = 0; axis < 3; ++axis)
      {
        expected[k / 3][k % 3] += cell[axis] * cell[axis] / 4 *
          image->GetDirectionMatrix()->GetElement(k / 3, axis) *
          image->GetDirectionMatrix()->GetElement(k % 3, axis);
      }
    }
    const auto s = gaussians.Covariance(i);
    const double found[6] = { expected[0][0], expected[1][1], expected[2][2], expected[0][1],
      expected[1][2], expected[0][2] };
    for (int k = 0; k < 6; ++k)
    {
      CHECK_NEAR(s[k], found[k], 1e-6);
    }
  }
  CHECK_NEAR(gaussians.TotalMass(), Extinction(0.5, 1.0) * 27, 1e-4);
}

TEST_CASE("Gaussians lie where the classified scalars are")
{
  // A layer of 0.08 cells at x = 3.3, which no plane between parts cuts: the scalar is x / 8.
  auto image = MakeImage(9, 6, 6, [](int x, int, int) { return x / 8.0; });
  const double from = 3.26 / 8, to = 3.34 / 8, edge = 1e-5, o = 0.4;
  const auto property =
    MakeProperty({ { from - edge, 0 }, { from, o }, { to, o }, { to + edge, 0 } }, 1.0);
  for (const int subdivision : { 0, 1, 2, 3 })
  {
    Run run(image, property, subdivision);
    const Gaussians gaussians = run.Result();
    CHECK(gaussians.Count() == 25 * (1 << 2 * subdivision));
    double least = 1e300, most = -1e300;
    for (vtkIdType i = 0; i < gaussians.Count(); ++i)
    {
      least = std::min(least, gaussians.Position(i)[0]);
      most = std::max(most, gaussians.Position(i)[0]);
    }
    // Samples are 1/4 of a part long; the layer is thinner.
    CHECK(most < 3.3 + 0.25 / (1 << subdivision));
    CHECK(least > 3.3 - 0.25 / (1 << subdivision));
    // The mass of the layer, whatever the samples: 0.08 wide, and a step of the table (0.0005).
    const double mass = Extinction(o, 1.0) * 0.08 * 25;
    CHECK_NEAR(gaussians.TotalMass(), mass, 0.03 * mass);
    // Flat where the layer is thinner than a sample.
    if (subdivision <= 1)
    {
      CHECK(gaussians.Covariance(0)[0] < 0.3 * gaussians.Covariance(0)[1]);
    }
    // Colour of the scalar 3.3 / 8.
    CHECK_NEAR(gaussians.Color(0)[0], 255 * (1 - 3.3 / 8), 1.5);
    CHECK_NEAR(gaussians.Color(0)[2], 255 * 3.3 / 8, 1.5);
  }
}

TEST_CASE("Empty space has no Gaussians")
{
  const auto image = MakeImage(9, 5, 5, [](int x, int, int) { return x < 4 ? 0.0 : 1.0; });
  Run some(image, MakeProperty({ { 0.9, 0.0 }, { 1.0, 0.5 } }, 1.0), 0);
  const Gaussians gaussians = some.Result();
  CHECK(gaussians.Count() == 5 * 16); // x from 4 to 8, and what is above 0.9 between 3 and 4
  Run none(image, MakeProperty({ { 0.0, 0.0 }, { 1.0, 0.0 } }, 1.0));
  CHECK(none.Result().Count() == 0);
}

TEST_CASE("Opacity 1 is limited")
{
  Run run(MakeImage(3, 3, 3, [](int, int, int) { return 1.0; }), MakeProperty({ { 0, 1 } }, 2.0));
  CHECK_NEAR(run.Result().TotalMass() / 8, 16.0 * std::log(2.0) / 2.0, 1e-4);
}

TEST_CASE("Hidden and unusable cells are empty")
{
  auto image = MakeImage(4, 4, 4, [](int x, int y, int z) { return x + y + z == 0 ? NaN : 1.0; });
  const auto property = MakeProperty({ { 0.0, 0.5 } }, 1.0);
  Run corner(image, property);
  CHECK(corner.Result().Count() == 26);
  CHECK(corner.Said.Warnings.empty());

  image->AllocateCellGhostArray();
  image->GetCellGhostArray()->SetValue(5, vtkDataSetAttributes::HIDDENCELL);
  image->GetCellGhostArray()->SetValue(6, vtkDataSetAttributes::DUPLICATECELL);
  Run hidden(image, property);
  CHECK(hidden.Result().Count() == 24);
  image->GetCellGhostArray()->SetNumberOfTuples(7); // too few to tell anything
  CHECK(Run(image, property).Result().Count() == 26);

  Run all(MakeImage(3, 3, 3, [](int, int, int) { return NaN; }), property);
  CHECK(all.Result().Count() == 0);
  CHECK(all.Said.Warnings.size() == 1);

  Run wild(
    MakeImage(5, 5, 5,
      [](int x, int, int) { return x == 2 ? std::numeric_limits<double>::infinity() : 1e30 * x; }),
    property);
  CHECK(wild.Result().Count() == 32);
  vtkNew<vtkDoubleArray> huge;
  huge->SetNumberOfTuples(27);
  huge->Fill(1.7e308);
  huge->SetValue(13, -1.7e308);
  const auto large = MakeImage(3, 3, 3, [](int, int, int) { return 1.0; });
  large->GetPointData()->SetScalars(huge);
  CHECK(Run(large, property).Result().Count() == 0);
}

TEST_CASE("Scalars beyond the functions do not coarsen the others")
{
  // A corner has 1e30, which marks missing values. Only its own cell changes.
  const auto property = MakeProperty({ { 0.0, 0.0 }, { 0.5, 0.0 }, { 1.0, 0.5 } }, 1.0);
  const auto wedge = [](int x, int, int) { return x / 8.0; };
  Run plain(MakeImage(9, 9, 9, wedge), property);
  Run marked(
    MakeImage(9, 9, 9, [&](int x, int y, int z) { return x + y + z == 0 ? 1e30 : wedge(x, y, z); }),
    property);
  const vtkIdType more = marked.Result().Count() - plain.Result().Count();
  CHECK(more >= 1);
  CHECK(more <= 8);
  CHECK(marked.Result().TotalMass() <= plain.Result().TotalMass() + Extinction(0.5, 1.0));
}

TEST_CASE("Unusable input is an error that says what to do")
{
  const auto image = MakeImage(3, 3, 3, [](int, int, int) { return 1.0; });
  const auto property = MakeProperty({ { 0.0, 0.5 } }, 1.0);
  CHECK(Contains(Run(image, nullptr).Error(), "SetVolumeProperty()"));

  const auto flat = MakeImage(3, 3, 1, [](int, int, int) { return 1.0; });
  CHECK(Contains(Run(flat, property).Error(), "3 x 3 x 1"));
  vtkNew<vtkImageData> none;
  none->SetDimensions(3, 3, 3);
  CHECK(Contains(Run(none, property).Error(), "no scalars"));
  const auto squeezed = MakeImage(3, 3, 3, [](int, int, int) { return 1.0; });
  squeezed->SetSpacing(1.0, 0.0, 1.0);
  CHECK(Contains(Run(squeezed, property).Error(), "no volume"));
  squeezed->SetSpacing(1e-20, 1e-20, 1e-20);
  CHECK(Contains(Run(squeezed, property).Error(), "1e-15"));
  squeezed->SetSpacing(1.0, NaN, 1.0);
  CHECK(Contains(Run(squeezed, property).Error(), "no volume"));

  CHECK(Contains(Run(image, MakeProperty({ { 0.0, 0.5 } }, 0.0)).Error(), "unit distance 0"));
  vtkNew<vtkFloatArray> pairs;
  pairs->SetNumberOfComponents(2);
  pairs->SetNumberOfTuples(27);
  pairs->Fill(1.0);
  image->GetPointData()->SetScalars(pairs);
  Run first(image, property); // independent: the first component
  CHECK(first.Result().Count() == 8);
  property->IndependentComponentsOff();
  CHECK(Contains(Run(image, property).Error(), "dependent"));
}

TEST_CASE("Of four dependent components three are the colour and one is classified")
{
  // Red from 0 to 200 along x, green 100, blue 0; the scalar is 40 at first and 240 from y = 3 on.
  const auto image = MakeImage(9, 7, 3, [](int, int, int) { return 0.0; });
  vtkNew<vtkUnsignedCharArray> colors;
  colors->SetNumberOfComponents(4);
  for (int i = 0; i < 9 * 7 * 3; ++i)
  {
    colors->InsertNextTuple4(25 * (i % 9), 100, 0, i / 9 % 7 < 3 ? 40 : 240);
  }
  image->GetPointData()->SetScalars(colors);
  const auto property = MakeProperty({ { 139, 0.0 }, { 141, 0.5 } }, 1.0);
  property->IndependentComponentsOff();
  Run run(image, property, 0);
  const Gaussians gaussians = run.Result();
  // One row of cells lies across the step at y = 2.5, 3 rows behind it.
  REQUIRE(gaussians.Count() == 8 * 4 * 2);
  for (vtkIdType i = 0; i < gaussians.Count(); ++i)
  {
    const Vec place = gaussians.Position(i), color = gaussians.Color(i);
    CHECK(place[1] > 2.5);
    CHECK_NEAR(color[0], 25 * place[0], 0.5 + 1e-4);
    CHECK(color[1] == 100);
    CHECK(color[2] == 0);
  }
  CHECK_NEAR(gaussians.TotalMass(), Extinction(0.5, 1.0) * 8 * 3.5 * 2, 0.5);

  vtkNew<vtkFloatArray> fractions; // the same colours as fractions of 1
  fractions->SetNumberOfComponents(4);
  for (int i = 0; i < 9 * 7 * 3; ++i)
  {
    const double* c = colors->GetTuple4(i);
    fractions->InsertNextTuple4(c[0] / 255, c[1] / 255, NaN, c[3]);
  }
  image->GetPointData()->SetScalars(fractions);
  Run other(image, property, 0);
  const Gaussians same = other.Result();
  REQUIRE(same.Count() == gaussians.Count());
  for (vtkIdType i = 0; i < same.Count(); ++i)
  {
    CHECK(Length(Minus(same.Color(i), gaussians.Color(i))) <= 1.0); // rounding
  }

  property->IndependentComponentsOn(); // the first component, and its colours
  Run first(image, MakeProperty({ { 0.0, 0.5 } }, 1.0));
  CHECK(first.Result().Color(0)[1] == 0);
  property->IndependentComponentsOff();
  Run particles(ToPolyData({ { 0, 0, 0 } }), property);
  vtkPolyData::SafeDownCast(particles.Filter->GetInput())->GetPointData()->SetScalars(colors);
  CHECK(!particles.Error().empty());
}

TEST_CASE("What has no effect is said, and what changes is done anew")
{
  const auto property = MakeProperty({ { 0.0, 0.5 } }, 1.0);
  Run run(MakeImage(3, 3, 3, [](int, int, int) { return 1.0; }), property);
  const double mass = run.Result().TotalMass();
  CHECK(run.Said.Warnings.empty());
  property->GetScalarOpacity()->AddPoint(0.0, 0.75);
  CHECK_NEAR(run.Result().TotalMass(), 2.0 * mass, 1e-5 * mass);
  property->GetGradientOpacity(); // makes one of 1, as VTK's mappers do
  run.Result();
  CHECK(run.Said.Warnings.empty());
  property->GetGradientOpacity()->AddPoint(0.0, 0.5);
  CHECK_NEAR(run.Result().TotalMass(), 2.0 * mass, 1e-5 * mass);
  REQUIRE(run.Said.Warnings.size() == 1);
  CHECK(Contains(run.Said.Warnings[0], "gradient opacity"));

  property->ShadeOn();
  Run particles(ToPolyData({ { 0, 0, 0 } }), property);
  vtkNew<vtkFloatArray> scalar;
  scalar->InsertNextValue(1.0f);
  vtkPolyData::SafeDownCast(particles.Filter->GetInput())->GetPointData()->SetScalars(scalar);
  particles.Filter->SetRadius(1.0);
  CHECK(!particles.Result().HasNormals());
  REQUIRE(particles.Said.Warnings.size() == 2);
  CHECK(Contains(particles.Said.Warnings[1], "not shaded"));
}

TEST_CASE("Abort")
{
  Run run(MakeImage(3, 3, 100, [](int, int, int) { return 1.0; }), MakeProperty({ { 0, 0.5 } }, 1));
  vtkNew<vtkCallbackCommand> stop;
  stop->SetCallback([](vtkObject* caller, unsigned long, void*, void*) {
    static_cast<vtkAlgorithm*>(caller)->SetAbortExecute(1);
  });
  run.Filter->AddObserver(vtkCommand::ProgressEvent, stop);
  CHECK(run.Error().empty());
}

TEST_CASE("The threads do not matter")
{
  const auto image = MakeImage(20, 20, 20, [](int x, int y, int z) {
    return 0.5 + 0.5 * std::sin(0.5 * x) * std::sin(0.7 * y) * std::cos(0.6 * z);
  });
  const auto property = MakeProperty({ { 0.3, 0.0 }, { 0.6, 0.5 }, { 0.7, 0.0 }, { 1, 0.9 } }, 1.0);
  property->ShadeOn();
  vtkNew<vtkPolyData> first;
  for (const int threads : { 1, 2, 8 })
  {
    vtkSMPTools::Initialize(threads);
    Run run(image, property);
    const vtkIdType count = run.Result().Count();
    vtkPolyData* output = run.Filter->GetOutput();
    if (threads == 1)
    {
      first->DeepCopy(output);
      CHECK(count > 4000);
    }
    REQUIRE(count == first->GetNumberOfPoints());
    const auto isSame = [count](vtkDataArray* a, vtkDataArray* b) {
      return std::memcmp(a->GetVoidPointer(0), b->GetVoidPointer(0),
               count * a->GetNumberOfComponents() * a->GetDataTypeSize()) == 0;
    };
    CHECK(isSame(output->GetPoints()->GetData(), first->GetPoints()->GetData()));
    for (const char* name :
      { Arrays::GaussianCovariance, Arrays::GaussianExtinction, Arrays::GaussianNormal, "RGB" })
    {
      CHECK(isSame(output->GetPointData()->GetArray(name), first->GetPointData()->GetArray(name)));
    }
  }
  vtkSMPTools::Initialize(0);
}

/// Particles with a scalar of 0.25 i and a radius of 0.1 (i + 1).
vtkSmartPointer<vtkPolyData> MakeParticles(const std::vector<Vec>& places)
{
  auto data = ToPolyData(places, VTK_DOUBLE);
  vtkNew<vtkFloatArray> scalars, radii;
  scalars->SetName("density");
  radii->SetName("radius");
  for (std::size_t i = 0; i < places.size(); ++i)
  {
    scalars->InsertNextValue(0.25f * i);
    radii->InsertNextValue(0.1f * (i + 1));
  }
  data->GetPointData()->SetScalars(scalars);
  data->GetPointData()->AddArray(radii);
  return data;
}

TEST_CASE("Particles become Gaussians of their radius")
{
  const std::vector<Vec> places = { { 1e7, 0, 0 }, { 1e7 + 0.25, 1, 2 }, { 1e7 + 1, 3, 5 } };
  const auto particles = MakeParticles(places);
  const auto property = MakeProperty({ { 0.0, 0.0 }, { 0.5, 0.8 } }, 2.0);
  Run run(particles, property);
  run.Filter->SetRadiusArrayName("radius");
  const Gaussians gaussians = run.Result();
  REQUIRE(gaussians.Count() == 2); // the first one is transparent
  for (vtkIdType i = 0; i < 2; ++i)
  {
    CHECK(Length(Minus(gaussians.Position(i), places[i + 1])) < 1e-6);
    const double variance = 0.01 * (i + 2) * (i + 2);
    const auto s = gaussians.Covariance(i);
    CHECK_NEAR(s[0], variance, 1e-6);
    CHECK_NEAR(s[1], variance, 1e-6);
    CHECK_NEAR(s[2], variance, 1e-6);
    CHECK(std::abs(s[3]) + std::abs(s[4]) + std::abs(s[5]) == 0.0);
  }
  // A step of the table is 0.5 / 16384 wide.
  CHECK_NEAR(gaussians.PeakExtinction(0), Extinction(0.4, 2.0), 1e-4);
  CHECK_NEAR(gaussians.PeakExtinction(1), Extinction(0.8, 2.0), 1e-4);
  CHECK_NEAR(gaussians.Color(0)[0], 191, 1);

  Run constant(particles, property);
  constant.Filter->SetRadius(0.5);
  CHECK_NEAR(constant.Result().Covariance(1)[2], 0.25, 1e-6);
}

TEST_CASE("Unusable particles are left out, and unusable clouds are errors")
{
  const auto property = MakeProperty({ { 0.0, 0.5 } }, 1.0);
  const auto particles = MakeParticles({ { NaN, 0, 0 }, { 0, 0, 0 }, { 1, 0, 0 }, { 2, 0, 0 } });
  particles->GetPointData()->GetScalars()->SetComponent(1, 0, NaN);
  particles->GetPointData()->GetArray("radius")->SetComponent(2, 0, -1.0);
  Run run(particles, property);
  run.Filter->SetRadiusArrayName("radius");
  CHECK(run.Result().Count() == 1);
  REQUIRE(run.Said.Warnings.size() == 1);
  CHECK(Contains(run.Said.Warnings[0], "3 particles"));

  CHECK(Contains(Run(particles, property).Error(), "a Radius above 0"));
  Run name(particles, property);
  name.Filter->SetRadiusArrayName("size");
  CHECK(Contains(name.Error(), "\"size\""));
  particles->GetPointData()->GetArray("radius")->SetNumberOfTuples(3);
  Run shorter(particles, property);
  shorter.Filter->SetRadiusArrayName("radius");
  CHECK(Contains(shorter.Error(), "\"radius\""));
  const auto bare = ToPolyData({ { 0, 0, 0 } });
  Run without(bare, property);
  without.Filter->SetRadius(1.0);
  CHECK(Contains(without.Error(), "no scalars"));
  vtkNew<vtkPolyData> empty;
  Run nothing(empty, property);
  nothing.Filter->SetRadius(1.0);
  CHECK(nothing.Result().Count() == 0);
}
}
