// SPDX-License-Identifier: BSD-3-Clause
#include "Core/Surfels/Shading.h"

#include <algorithm>

namespace SurfelSplatting
{
namespace
{
/// Direction from the surfel to the light and what reaches the surfel of it, 0 outside a spot's
/// cone.
double Incidence(const Light& light, const Vector3& position, Vector3& toLight)
{
  if (!light.Positional)
  {
    toLight = { -light.Direction[0], -light.Direction[1], -light.Direction[2] };
    return 1.0;
  }
  toLight = { light.Position[0] - position[0], light.Position[1] - position[1],
    light.Position[2] - position[2] };
  const double distance = Norm(toLight);
  if (distance <= 0.0)
  {
    return 0.0;
  }
  for (double& x : toLight)
  {
    x /= distance;
  }
  const double falloff = light.Attenuation[0] + light.Attenuation[1] * distance +
    light.Attenuation[2] * distance * distance;
  double strength = falloff > 0.0 ? 1.0 / falloff : 1.0;
  if (light.ConeCosine > -1.0)
  {
    const double cosine = -Dot(toLight, light.Direction);
    // Behind a spot wider than a half space the cosine is negative.
    strength *= cosine >= light.ConeCosine ? std::pow(std::max(cosine, 0.0), light.Exponent) : 0.0;
  }
  return strength;
}
}

std::array<double, 3> Shade(const Material& material, const std::vector<Light>& lights,
  const std::array<double, 3>& color, const std::array<double, 3>& ambientColor,
  const Vector3& position, const Vector3& normal, const Vector3& toViewer)
{
  if (!material.Lit)
  {
    return color;
  }
  std::array<double, 3> diffuse{ 0, 0, 0 }, specular{ 0, 0, 0 };
  for (const Light& light : lights)
  {
    Vector3 toLight;
    const double strength = Incidence(light, position, toLight);
    const double cosine = Dot(normal, toLight);
    if (strength <= 0.0 || cosine <= 0.0)
    {
      continue;
    }
    // Phong: the light's mirror direction, 2 (n.l) n - l, against the viewer's.
    const double reflected =
      light.LoneHeadlight ? cosine : 2.0 * cosine * Dot(normal, toViewer) - Dot(toLight, toViewer);
    const double highlight = material.Specular > 0.0 && reflected > 0.0
      ? std::pow(reflected, material.SpecularPower)
      : 0.0;
    for (int c = 0; c < 3; ++c)
    {
      diffuse[c] += strength * cosine * light.Color[c];
      specular[c] += strength * highlight * light.Color[c];
    }
  }
  std::array<double, 3> result;
  for (int c = 0; c < 3; ++c)
  {
    result[c] = material.Ambient * ambientColor[c] + material.Diffuse * color[c] * diffuse[c] +
      material.Specular * material.SpecularColor[c] * specular[c];
  }
  return result;
}
}
