// SPDX-License-Identifier: BSD-3-Clause
// Normals of a volume's Gaussians, against closed forms, and the material that shades them.
#include "VolumeTesting.h"

#include "vtkDoubleArray.h"
#include "vtkProperty.h"

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
  // -(1 - f, f, 0), so that of a Gaussian tells its place, the mean of the extinction.
  const double rows[4][2] = { { -10, -10 }, { 0, 0 }, { 1, 3 }, { 0, 0 } };
  const auto image = MakeImage(4, 2, 2, [&rows](int x, int y, int) { return rows[x][y]; });
  const auto property = MakeProperty({ { -10, 0.0 }, { 0, 0.1 }, { 3, 0.9 } }, 1.0);
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
