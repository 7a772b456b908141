// SPDX-License-Identifier: BSD-3-Clause
/**
 * The light model against the formulas of VTK's shader (vtkOpenGLPolyDataMapper, positional
 * lights), written out here.
 */
#include "Core/Base/LinearLight.h"
#include "TestScene.h"
#include "Testing/Shared/Check.h"

#include <algorithm>

using namespace SurfelSplatting;

namespace
{
/// GLSL's reflect(i, n).
Vector3 Reflect(const Vector3& i, const Vector3& n)
{
  return i - 2.0 * Dot(n, i) * n;
}

struct Lambert
{
  double Diffuse, Specular;
};

/// Names as in the shader: vertLightDirectionVC, attenuation, df, sf.
Lambert ShaderLight(const Light& light, double coneAngle, double power, const Vector3& vertexVC,
  const Vector3& normalVC)
{
  double attenuation = 1.0;
  Vector3 direction = light.Direction;
  if (light.Positional)
  {
    direction = vertexVC - light.Position;
    const double distance = Norm(direction);
    direction = (1.0 / distance) * direction;
    attenuation = 1.0 /
      (light.Attenuation[0] + light.Attenuation[1] * distance +
        light.Attenuation[2] * distance * distance);
    if (coneAngle < 90.0)
    {
      const double coneDot = Dot(direction, light.Direction);
      attenuation = coneDot >= std::cos(coneAngle * 3.14159265358979324 / 180.0)
        ? attenuation * std::pow(coneDot, light.Exponent)
        : 0.0;
    }
  }
  const double df = std::max(0.0, attenuation * -Dot(normalVC, direction));
  const double cosine =
    std::max(0.0, Dot(Reflect(direction, normalVC), Normalized(-1.0 * vertexVC)));
  const double sf = (df > 0.0 ? 1.0 : 0.0) * attenuation * std::pow(cosine, power);
  return { df, sf };
}

Light RandomLight(Random& random, int kind, double& coneAngle)
{
  Light light;
  for (double& c : light.Color)
  {
    c = random.Uniform(0.0, 2.0);
  }
  light.Direction = random.Direction();
  light.Positional = kind > 0;
  light.Position = random.Uniform(0.5, 5.0) * random.Direction();
  coneAngle = 90.0;
  if (kind > 0)
  {
    light.Attenuation = { random.Uniform(0.5, 2.0), random.Uniform(0.0, 1.0),
      random.Uniform(0.0, 0.3) };
  }
  if (kind == 2)
  {
    coneAngle = random.Uniform(5.0, 89.0);
    light.ConeCosine = std::cos(coneAngle * 3.14159265358979324 / 180.0);
    light.Exponent = random.Uniform(0.0, 10.0);
  }
  return light;
}

Material RandomMaterial(Random& random)
{
  Material material;
  material.Lit = true;
  material.Ambient = random.Uniform(0.0, 1.0);
  material.Diffuse = random.Uniform(0.0, 1.0);
  material.Specular = random.Uniform(0.0, 1.0);
  material.SpecularPower = random.Uniform(1.0, 100.0);
  for (double& c : material.SpecularColor)
  {
    c = random.Uniform(0.0, 1.0);
  }
  return material;
}

TEST_CASE("Against shader")
{
  Random random(3);
  int lit = 0;
  for (int i = 0; i < 6000; ++i)
  {
    const Material material = RandomMaterial(random);
    std::vector<Light> lights;
    std::vector<double> cones;
    for (int l = 0; l <= i % 3; ++l)
    {
      double cone;
      lights.push_back(RandomLight(random, random.Integer(0, 2), cone));
      cones.push_back(cone);
    }
    const std::array<double, 3> color{ random.Uniform(0, 1), random.Uniform(0, 1), 0.5 };
    const std::array<double, 3> ambient{ 0.3, random.Uniform(0, 1), random.Uniform(0, 1) };
    const Vector3 position{ random.Uniform(-2, 2), random.Uniform(-2, 2), random.Uniform(0.5, 5) };
    const Vector3 normal = random.Direction();
    const std::array<double, 3> result =
      Shade(material, lights, color, ambient, position, normal, Normalized(-1.0 * position));
    for (int c = 0; c < 3; ++c)
    {
      double expected = material.Ambient * ambient[c];
      for (std::size_t l = 0; l < lights.size(); ++l)
      {
        const Lambert s =
          ShaderLight(lights[l], cones[l], material.SpecularPower, position, normal);
        expected += lights[l].Color[c] *
          (material.Diffuse * color[c] * s.Diffuse +
            material.Specular * material.SpecularColor[c] * s.Specular);
        lit += s.Diffuse > 0.0 ? 1 : 0;
      }
      // Rounding; a power of up to 100 multiplies that of its base.
      CHECK_NEAR(result[c], expected, 1e-13 * (1.0 + expected));
    }
  }
  CHECK(lit > 5000);
}

TEST_CASE("Unlit")
{
  Material material; // not lit
  material.Ambient = 0.7;
  const std::array<double, 3> color{ 0.2, 0.4, 3.0 };
  CHECK(Shade(material, { Light() }, color, { 1, 1, 1 }, { 0, 0, 1 }, { 0, 0, 1 }, { 0, 0, -1 }) ==
    color);
}

/// A spot wider than a half space reaches surfels behind it, where the cosine is negative.
TEST_CASE("Wide spot")
{
  Light light;
  light.Positional = true;
  light.Position = { 0, 0, 2 };
  light.Direction = { 0.8, 0, 0.6 };
  light.ConeCosine = -0.99;
  light.Exponent = 0.5;
  Material material;
  material.Lit = true;
  const std::array<double, 3> result =
    Shade(material, { light }, { 1, 1, 1 }, { 1, 1, 1 }, { 0, 0, 1 }, { 0, 0, 1 }, { 0, 0, -1 });
  CHECK(std::isfinite(result[0]));
}

float RedAtCentre(const TestSurfel& surfel, const Light& light)
{
  TestCloud cloud;
  cloud.Surface.Lit = true;
  cloud.Add(surfel);
  SplatContext context;
  context.Camera = PinholeView(9, 9, 100.0);
  context.Lights.push_back(light);
  const Picture picture = RenderPicture(context, cloud);
  return picture.At(4, 4, 3) > 0.0f ? picture.At(4, 4, 0) / picture.At(4, 4, 3) : -1.0f;
}

/// The side that is seen is lit: a two-sided surfel turned away looks like one turned to the lens.
TEST_CASE("Back side")
{
  Light fromLens; // along z
  Light fromBehind;
  fromBehind.Direction = { 0, 0, -1 };
  TestSurfel surfel;
  surfel.TwoSided = true;
  for (double z : { -1.0, 1.0 })
  {
    surfel.Normal = { 0, 0, z };
    CHECK_NEAR(RedAtCentre(surfel, fromLens), 1.0, 1e-6); // a quotient of two floats
    CHECK_NEAR(RedAtCentre(surfel, fromBehind), 0.0, 0.0);
  }
  surfel.TwoSided = false;
  CHECK_NEAR(RedAtCentre(surfel, fromLens), -1.0, 0.0); // turned away: not seen
}
}

/// Values of the standard, both ways and above 1.
TEST_CASE("sRGB")
{
  CHECK_NEAR(LightOfCode(0.0), 0.0, 0.0);
  CHECK_NEAR(LightOfCode(1.0), 1.0, 1e-12);
  CHECK_NEAR(LightOfCode(0.5), 0.21404114048, 1e-9);
  CHECK_NEAR(CodeOfLight(0.5), 0.73535698305, 1e-9);
  CHECK_NEAR(LightOfCode(-1.0), 0.0, 0.0);
  CHECK_NEAR(CodeOfLight(-1.0), 0.0, 0.0);
  for (int i = 0; i <= 1000; ++i)
  {
    const double v = 0.01 * i;
    CHECK_NEAR(CodeOfLight(LightOfCode(v)), v, 1e-7 * (1.0 + v)); // the two pieces meet to 1e-8
  }
}
