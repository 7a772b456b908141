// SPDX-License-Identifier: BSD-3-Clause
/**
 * Per-splat shading: VTK's light model (ambient, Lambert, Phong) evaluated once for each surfel, so
 * that highlights blur with their surface (Krivanek, Zara, Bouatouch 2003, section 4, "Shading").
 */
#pragma once

#include "Core/Base/Geometry.h"

#include <array>
#include <vector>

namespace SurfelSplatting
{
struct Light
{
  std::array<double, 3> Color{ 1, 1, 1 }; ///< times the light's intensity
  bool Positional = false;
  Vector3 Position{ 0, 0, 0 };  ///< camera space
  Vector3 Direction{ 0, 0, 1 }; ///< from the light, camera space, unit length
  std::array<double, 3> Attenuation{ 1, 0,
    0 };                    ///< 1 / (a0 + a1 d + a2 d^2), positional lights only
  double ConeCosine = -1.0; ///< cosine of the spot's half angle; -1: no spot
  /// The only light, at the camera: VTK then takes (n.l)^p for the highlight instead of Phong's
  /// (r.v)^p.
  bool LoneHeadlight = false;
  double Exponent = 1.0; ///< of the spot
};

struct Material
{
  bool Lit = false; ///< false: colours as they are
  double Ambient = 0.0;
  double Diffuse = 1.0;
  double Specular = 0.0;
  double SpecularPower = 1.0;
  std::array<double, 3> Color{ 1, 1, 1 };        ///< of surfels without colours of their own
  std::array<double, 3> AmbientColor{ 1, 1, 1 }; ///< likewise
  std::array<double, 3> SpecularColor{ 1, 1, 1 };
};

/**
 * Light leaving a surfel towards the lens, linear RGB.
 * @param color        diffuse (and ambient) colour of the surfel
 * @param ambientColor its ambient colour
 * @param position     camera space
 * @param normal       camera space, unit length, on the side that is seen
 * @param toViewer     camera space, unit length
 */
std::array<double, 3> Shade(const Material& material, const std::vector<Light>& lights,
  const std::array<double, 3>& color, const std::array<double, 3>& ambientColor,
  const Vector3& position, const Vector3& normal, const Vector3& toViewer);
}
