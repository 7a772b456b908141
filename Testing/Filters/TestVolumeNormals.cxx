// SPDX-License-Identifier: BSD-3-Clause
// Normals of a volume's Gaussians, against closed forms, and the material that shades them.
#include "Testing/Shared/Random.h"
#include "VolumeTesting.h"

#include "vtkCellData.h"
#include "vtkDataSetAttributes.h"
#include "vtkDoubleArray.h"
#include "vtkProperty.h"
#include "vtkTrivialProducer.h"

using namespace SurfelTesting;

namespace
{
/// A property of the same opacity everywhere, with shading.
vtkSmartPointer<vtkVolumeProperty> MakeShadedProperty()
{
  const auto property = MakeProperty({ { 0.0, 0.5 } }, 1.0);
  property->ShadeOn();
  return property;
}

/// Scalars that a function of world coordinates gives.
void SetScalars(vtkImageData* image, const std::function<double(const Vec&)>& scalar)
{
  vtkDataArray* scalars = image->GetPointData()->GetScalars();
  for (vtkIdType i = 0; i < image->GetNumberOfPoints(); ++i)
  {
    Vec place;
    image->GetPoint(i, place.data());
    scalars->SetComponent(i, 0, scalar(place));
  }
}

TEST_CASE("Normals of a linear ramp are opposite to its gradient")
{
  const auto image = MakeTurnedImage(4);
  const Vec gradient{ 0.3, -0.5, 0.2 };
  const Vec origin{ 1000.0, -2000.0, 3000.0 };
  SetScalars(image, [&](const Vec& x) { return Dot(gradient, Minus(x, origin)); });
  const auto property = MakeShadedProperty();
  const double length = Length(gradient);
  // A direction matrix that mirrors, and one that is no rotation; borders count, too.
  for (int kind = 0; kind < 3; ++kind)
  {
    if (kind == 1)
    {
      image->SetDirectionMatrix(-1, 0, 0, 0, 0, 1, 0, 1, 0);
    }
    else if (kind == 2)
    {
      image->SetDirectionMatrix(1, 0.5, 0, 0, 0.8, 0, 0.2, 0, -1.1);
    }
    SetScalars(image, [&](const Vec& x) { return Dot(gradient, Minus(x, origin)); });
    Run run(image, property);
    const Gaussians gaussians = run.Result();
    CHECK(run.Said.Warnings.empty());
    REQUIRE(gaussians.Count() >= 27);
    REQUIRE(gaussians.HasNormals());
    for (vtkIdType i = 0; i < gaussians.Count(); ++i)
    {
      const Vec n = gaussians.Normal(i);
      for (int k = 0; k < 3; ++k)
      {
        CHECK_NEAR(n[k], -gradient[k] / length, 1e-4); // scalars are floats
      }
    }
  }
  property->ShadeOff();
  Run without(image, property);
  CHECK(!without.Result().HasNormals());
}

TEST_CASE("Normals of a sphere point outwards, and are shorter where they disagree")
{
  const auto image = MakeImage(21, 21, 21, [](int, int, int) { return 0.0; });
  image->SetOrigin(-10, -10, -10);
  SetScalars(image, [](const Vec& x) { return -Dot(x, x); }); // of which differences are exact
  Run run(image, MakeShadedProperty(), 0);
  const Gaussians gaussians = run.Result();
  REQUIRE(gaussians.Count() == 8000);
  double closest = 1.0;
  for (vtkIdType i = 0; i < gaussians.Count(); ++i)
  {
    const Vec x = gaussians.Position(i), n = gaussians.Normal(i);
    const double r = Length(x), length = Length(n);
    closest = std::min(closest, length);
    // The mean over a cube of the unit vectors of its corners, interpolated: x / r (1 - V / r^2), V
    // the variance 1/12 and 1/6 of the interpolation for two axes across.
    const bool isInside = std::abs(x[0]) < 9 && std::abs(x[1]) < 9 && std::abs(x[2]) < 9;
    if (isInside && r > 3.0)
    {
      CHECK_NEAR(length, 1.0 - 0.25 / (r * r), 0.5 / std::pow(r, 4));
      CHECK(Dot(n, x) > 0.9999 * length * r);
    }
    CHECK(length <= 1.0);
  }
  CHECK(closest < 0.7); // about the centre, where they cancel
}

TEST_CASE("Normals are interpolated, and weighted by the extinction")
{
  // At x = 1 the scalar rises along x only, at x = 2 along y only: between them the normal is
  // -(1 - f, f, 0), so that of a Gaussian tells its place, the mean of the extinction. No scalar is
  // transparent, so that faces do not count.
  const double rows[4][2] = { { -10, -10 }, { 0, 0 }, { 1, 3 }, { 0, 0 } };
  const auto image = MakeImage(4, 2, 2, [&rows](int x, int y, int) { return rows[x][y]; });
  const auto property = MakeProperty({ { -10, 1e-9 }, { 0, 0.1 }, { 3, 0.9 } }, 1.0);
  property->ShadeOn();
  double farthest = 0.0;
  for (const int subdivision : { 0, 2 })
  {
    Run run(image, property, subdivision);
    const Gaussians gaussians = run.Result();
    int between = 0;
    for (vtkIdType i = 0; i < gaussians.Count(); ++i)
    {
      const double f = gaussians.Position(i)[0] - 1.0;
      if (f > 0.0 && f < 1.0)
      {
        ++between;
        farthest = std::max(farthest, std::abs(f - 0.5));
        const Vec n = gaussians.Normal(i);
        CHECK_NEAR(n[0], f - 1.0, 1e-6);
        CHECK_NEAR(n[1], -f, 1e-6);
        CHECK_NEAR(n[2], 0.0, 1e-6);
      }
    }
    CHECK(between > (subdivision > 0 ? 8 : 0));
  }
  CHECK(farthest > 0.1);
}

TEST_CASE("No gradient, no normal; what is not finite does not count")
{
  const auto property = MakeShadedProperty();
  Run flat(MakeImage(4, 4, 4, [](int, int, int) { return 1.0; }), property);
  const Gaussians gaussians = flat.Result();
  for (vtkIdType i = 0; i < gaussians.Count(); ++i)
  {
    CHECK(Length(gaussians.Normal(i)) == 0.0);
  }
  // A ramp beside a point that is not a number: the differences there are one-sided.
  const auto image = MakeImage(6, 6, 6, [](int x, int, int) { return 0.1 * x; });
  image->GetPointData()->GetScalars()->SetComponent(2 * 36 + 2 * 6 + 2, 0, NaN);
  image->GetPointData()->GetScalars()->SetComponent(4 * 36 + 4 * 6 + 4, 0, 1e301 * 1e10);
  Run ramp(image, property);
  const Gaussians sloped = ramp.Result();
  CHECK(sloped.Count() == 125 - 16);
  for (vtkIdType i = 0; i < sloped.Count(); ++i)
  {
    CHECK_NEAR(sloped.Normal(i)[0], -1.0, 1e-6);
  }
  // The largest differences there are.
  vtkNew<vtkDoubleArray> huge;
  for (int i = 0; i < 27; ++i)
  {
    huge->InsertNextValue(i % 2 ? 1e300 : -1e300);
  }
  const auto wide = MakeImage(3, 3, 3, [](int, int, int) { return 0.0; });
  wide->GetPointData()->SetScalars(huge);
  wide->SetSpacing(1e-15, 1.0, 1e15);
  Run extreme(wide, property);
  CHECK(extreme.Result().IsFinite());
}

/// A property whose opacity grows from 0 at one scalar to 0.9 at another.
vtkSmartPointer<vtkVolumeProperty> MakeSolidProperty(double transparent, double solid)
{
  const auto property = MakeProperty({ { transparent, 0.0 }, { solid, 0.9 } }, 1.0);
  property->ShadeOn();
  return property;
}

TEST_CASE("Where a face of the image cuts an object, its normals are those of the face")
{
  // The outside is transparent: below what is solid, and above it for a hole in something bright.
  for (const int sign : { 1, -1 })
  {
    Random random(1); // noise, which pointed anywhere before
    const auto image =
      MakeImage(6, 6, 6, [&](int, int, int) { return sign * (1.0 + 0.02 * random()); });
    Run run(image, MakeSolidProperty(0.0, sign));
    const Gaussians gaussians = run.Result();
    REQUIRE(gaussians.Count() == 125);
    for (vtkIdType i = 0; i < gaussians.Count(); ++i)
    {
      const Vec place = gaussians.Position(i), n = gaussians.Normal(i);
      Vec expected{ 0.0, 0.0, 0.0 };
      for (int k = 0; k < 3; ++k)
      {
        expected[k] = place[k] < 1.0 ? -sign : place[k] > 4.0 ? sign : 0.0;
      }
      const double length = Length(expected);
      if (length > 0.0)
      {
        CHECK(Dot(n, expected) > 0.999 * length);
      }
    }
  }
}

TEST_CASE("Faces do not count where the outside is not known")
{
  // Layers; what is nowhere transparent; and a function that is 0 beyond its ends.
  const auto image = MakeImage(4, 4, 4, [](int, int, int) { return 0.5; });
  const auto layer = MakeProperty({ { 0.0, 0.0 }, { 0.5, 0.5 }, { 1.0, 0.0 } }, 1.0);
  const auto dense = MakeProperty({ { 0.0, 0.1 }, { 1.0, 0.9 } }, 1.0);
  const auto ends = MakeProperty({ { 0.0, 0.0 }, { 1.0, 0.9 } }, 1.0);
  ends->GetScalarOpacity()->ClampingOff();
  for (const auto& property : { layer, dense, ends })
  {
    property->ShadeOn();
    Run run(image, property);
    const Gaussians gaussians = run.Result();
    REQUIRE(gaussians.Count() == 27);
    for (vtkIdType i = 0; i < 27; ++i)
    {
      CHECK(Length(gaussians.Normal(i)) == 0.0);
    }
  }
  // One transparent range between two others: each has its own side.
  const auto valley = MakeProperty({ { -1, 0.9 }, { -0.5, 0 }, { 0.25, 0 }, { 1, 0.9 } }, 1.0);
  valley->ShadeOn();
  for (const double scalar : { -1.0, 1.0 })
  {
    Run run(MakeImage(4, 4, 4, [&](int, int, int) { return scalar; }), valley);
    const Gaussians gaussians = run.Result();
    CHECK_NEAR(gaussians.Normal(4)[2], -scalar, 1e-6); // in the middle of the low z
  }
}

TEST_CASE("Surfaces beside a face keep their normals, and so do single layers and cells")
{
  const auto property = MakeSolidProperty(0.1, 1.0);
  const double rows[2][5] = { { 0, 1, 1, 1, 1 }, { 1, 0, 0, 0, 0 } };
  for (const auto& row : rows)
  {
    Run run(MakeImage(5, 9, 9, [&row](int x, int, int) { return row[x]; }), property, 0);
    const Gaussians gaussians = run.Result();
    int found = 0;
    for (vtkIdType i = 0; i < gaussians.Count(); ++i)
    {
      const Vec x = gaussians.Position(i);
      if (x[0] < 1.0 && x[1] > 1.0 && x[1] < 7.0 && x[2] > 1.0 && x[2] < 7.0)
      {
        ++found;
        CHECK(gaussians.Normal(i)[0] < -0.7);
      }
    }
    CHECK(found == 36);
  }
  // The corners of a single cell are at three faces each.
  Run run(MakeImage(2, 2, 2, [](int, int, int) { return 1.0; }), property, 1);
  CHECK(Length(run.Result().Normal(0)) < 1e-6); // opposite ones
}

TEST_CASE("A piece with ghost cells has the normals of the whole")
{
  const auto scalar = [](int x, int y, int z) {
    return 1.0 + 0.1 * std::sin(3.0 * x + 5.0 * y + z);
  };
  const auto property = MakeSolidProperty(0.0, 1.0);
  const auto image = MakeImage(9, 6, 5, scalar);
  Run whole(image, property, 0);
  const Gaussians expected = whole.Result();
  REQUIRE(expected.Count() == 160);
  // The cells from x = 4 on, and those before as ghosts.
  const auto piece = MakeImage(6, 6, 5, [&](int x, int y, int z) { return scalar(x + 3, y, z); });
  piece->SetExtent(3, 8, 0, 5, 0, 4);
  piece->AllocateCellGhostArray();
  for (int cell = 0; cell < 100; cell += 5)
  {
    piece->GetCellGhostArray()->SetValue(cell, vtkDataSetAttributes::DUPLICATECELL);
  }
  vtkNew<vtkTrivialProducer> producer;
  producer->SetOutput(piece);
  producer->SetWholeExtent(0, 8, 0, 5, 0, 4);
  Run run(piece, property, 0);
  run.Filter->SetInputConnection(producer->GetOutputPort());
  const Gaussians gaussians = run.Result();
  REQUIRE(gaussians.Count() == 80);
  for (int i = 0; i < 80; ++i)
  {
    const int of = i / 4 * 8 + 4 + i % 4;
    CHECK(Length(Minus(gaussians.Position(i), expected.Position(of))) < 1e-5);
    CHECK(gaussians.Normal(i) == expected.Normal(of));
  }
  // Without ghost cells the inner side is no face either.
  piece->GetCellData()->Initialize();
  piece->Modified();
  const Gaussians alone = run.Result();
  REQUIRE(alone.Count() == 100);
  CHECK(std::abs(alone.Normal(5 * 5 * 1 + 5 * 2)[0]) < 0.9);
}

TEST_CASE("Normals of another array")
{
  const auto image = MakeImage(5, 5, 5, [](int x, int, int) { return x < 2 ? 0.0 : 1.0; });
  vtkNew<vtkDoubleArray> slope;
  slope->SetName("slope");
  slope->SetNumberOfComponents(2);
  for (int i = 0; i < 125; ++i)
  {
    slope->InsertNextTuple2(i / 5 % 5, NaN);
  }
  slope->SetComponent(2 * 25 + 2 * 5 + 3, 0, NaN); // no gradient there, and one-sided beside it
  image->GetPointData()->AddArray(slope);
  const auto property = MakeProperty({ { 0.0, 0.1 }, { 1.0, 0.9 } }, 1.0);
  property->ShadeOn();
  Run run(image, property, 0);
  run.Filter->SetGradientArrayName("slope");
  const Gaussians gaussians = run.Result();
  REQUIRE(gaussians.Count() == 64);
  for (vtkIdType i = 0; i < 64; ++i)
  {
    const Vec x = gaussians.Position(i), n = gaussians.Normal(i);
    const bool isBeside =
      std::abs(x[0] - 3) < 1 && std::abs(x[1] - 2) < 1 && std::abs(x[2] - 2) < 1;
    CHECK_NEAR(n[0], 0.0, 1e-6);
    CHECK(n[1] < (isBeside ? -0.7 : -0.999));
  }
  Run none(image, property, 0);
  none.Filter->SetGradientArrayName("none");
  CHECK(Contains(none.Error(), "SetGradientArrayName()"));
  slope->SetNumberOfTuples(124);
  Run shorter(image, property, 0);
  shorter.Filter->SetGradientArrayName("slope");
  CHECK(Contains(shorter.Error(), "SetGradientArrayName()"));
  property->ShadeOff(); // needs no gradient
  Run unlit(image, property, 0);
  unlit.Filter->SetGradientArrayName("none");
  CHECK(unlit.Result().Count() == 64);
}

TEST_CASE("The material of a volume becomes that of an actor")
{
  vtkNew<vtkVolumeProperty> volume;
  volume->SetAmbient(0.2);
  volume->SetDiffuse(0.6);
  volume->SetSpecular(0.3);
  volume->SetSpecularPower(7.0);
  vtkNew<vtkProperty> property;
  property->SetColor(0.5, 0.5, 0.5);
  vtkVolumeSplatting::CopyMaterial(volume, property);
  CHECK(property->GetAmbient() == 0.2);
  CHECK(property->GetDiffuse() == 0.6);
  CHECK(property->GetSpecular() == 0.3);
  CHECK(property->GetSpecularPower() == 7.0);
  CHECK(property->GetSpecularColor()[1] == 1.0);
}
}
