// SPDX-License-Identifier: BSD-3-Clause
/**
 * Per-splat shading: VTK's light model (ambient, Lambert, Phong) evaluated once for each surfel, so
 * that highlights blur with their surface (Krivanek, Zara, Bouatouch 2003, section 4, "Shading").
 */
#pragma once

#include "Core/Base/Geometry.h"
#include "Core/Simd/RealLanes.h"

#include <array>
#include <cstddef>

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
  /// Whether this is the only light and sits at the camera. VTK then uses (n.l)^p for the highlight
  /// instead of Phong's (r.v)^p.
  bool LoneHeadlight = false;
  double Exponent = 1.0; ///< of the spot
};

struct Material
{
  bool Lit = false; ///< false: colours are not shaded
  double Ambient = 0.0;
  double Diffuse = 1.0;
  double Specular = 0.0;
  double SpecularPower = 1.0;
  std::array<double, 3> Color{ 1, 1, 1 };        ///< of surfels without colours of their own
  std::array<double, 3> AmbientColor{ 1, 1, 1 }; ///< of surfels without colours of their own
  std::array<double, 3> SpecularColor{ 1, 1, 1 };
};

/// What light falls on, and how it is reflected.
struct Lighting
{
  Material Surface;
  bool HasSurfelColors = false; ///< these are then the ambient colour too
  const Light* Lights = nullptr;
  std::size_t NumberOfLights = 0;
};

/// Components of a vector or a colour. std::array's own functions are not always inlined
/// (Core/Simd/Inline.h).
SURFELSPLATTING_INLINE const double* Components(const std::array<double, 3>& a)
{
  return reinterpret_cast<const double*>(&a);
}

/// The shaded colour of a surfel is Base + Share * its own colour, channel by channel. Since this
/// is affine, a gradient of the colour remains a gradient.
template <class Real>
struct ShadedColor
{
  Real Base[3], Share[3];
};

/// Share of a light that reaches a point; 0 outside a spot's cone.
/// @param toLight receives the direction to the light, unit length
template <class Real>
SURFELSPLATTING_INLINE Real Incidence(
  const Light& light, const Vector3Of<Real>& p, Vector3Of<Real>& toLight)
{
  const double *d = Components(light.Direction), *from = Components(light.Position);
  if (!light.Positional)
  {
    toLight = { Uniform<Real>(-d[0]), Uniform<Real>(-d[1]), Uniform<Real>(-d[2]) };
    return Uniform<Real>(1.0);
  }
  toLight = { from[0] - p.X, from[1] - p.Y, from[2] - p.Z };
  const Real distance = Norm(toLight);
  const Real inverse = distance > 0.0 ? 1.0 / distance : Real{};
  toLight = { toLight.X * inverse, toLight.Y * inverse, toLight.Z * inverse };
  const double* a = Components(light.Attenuation);
  const Real falloff = a[0] + a[1] * distance + a[2] * distance * distance;
  Real strength = falloff > 0.0 ? 1.0 / falloff : Uniform<Real>(1.0);
  if (light.ConeCosine > -1.0)
  {
    const Real cosine = -(d[0] * toLight.X + d[1] * toLight.Y + d[2] * toLight.Z);
    // Behind a spot wider than a half space the cosine is negative.
    strength *= cosine >= light.ConeCosine ? Power(Larger(cosine, Real{}), light.Exponent) : Real{};
  }
  return distance > 0.0 ? strength : Real{};
}

/// What light falls on and leaves from.
template <class Real>
struct Facet
{
  Vector3Of<Real> Position; ///< camera space
  Vector3Of<Real> Normal;   ///< camera space, unit length, of the visible side
  Vector3Of<Real> ToViewer; ///< camera space, unit length
};

/**
 * Light that a facet reflects towards the lens, linear RGB: ambient, Lambert and highlights.
 * @param highlight function(light, direction to the light, cosine of the normal with it): the share
 *                  of Material::Specular
 */
template <class Real, class Highlight>
SURFELSPLATTING_INLINE ShadedColor<Real> Reflect(
  const Lighting& lighting, const Facet<Real>& facet, const Highlight& highlight)
{
  const Material& material = lighting.Surface;
  Real diffuse[3] = {}, specular[3] = {};
  for (std::size_t i = 0; i < lighting.NumberOfLights; ++i)
  {
    const Light& light = lighting.Lights[i];
    const double* color = Components(light.Color);
    Vector3Of<Real> toLight;
    Real strength = Incidence(light, facet.Position, toLight);
    const Real cosine = Dot(facet.Normal, toLight);
    strength = ((strength > 0.0) & (cosine > 0.0)) ? strength : Real{};
    const Real shine = material.Specular > 0.0 ? highlight(light, toLight, cosine) : Real{};
    for (int c = 0; c < 3; ++c)
    {
      diffuse[c] += strength > 0.0 ? strength * cosine * color[c] : Real{};
      specular[c] += strength > 0.0 ? strength * shine * color[c] : Real{};
    }
  }
  const bool own = lighting.HasSurfelColors;
  const double *ambientColor = Components(material.AmbientColor),
               *specularColor = Components(material.SpecularColor);
  ShadedColor<Real> shaded;
  for (int c = 0; c < 3; ++c)
  {
    const double ambient = own ? 0.0 : material.Ambient * ambientColor[c];
    shaded.Base[c] = ambient + material.Specular * specularColor[c] * specular[c];
    shaded.Share[c] = (own ? material.Ambient : 0.0) + material.Diffuse * diffuse[c];
  }
  return shaded;
}

/// Light that a surfel reflects. Like VTK, the highlight is (n.l)^p for a lone headlight, and
/// otherwise Phong's (r.v)^p with the mirror direction r = 2 (n.l) n - l.
template <class Real>
SURFELSPLATTING_INLINE ShadedColor<Real> Shade(const Lighting& lighting, const Facet<Real>& facet)
{
  const auto highlight = [&](
                           const Light& light, const Vector3Of<Real>& toLight, const Real& cosine) {
    const Vector3Of<Real>&n = facet.Normal, v = facet.ToViewer;
    const Real reflected =
      light.LoneHeadlight ? cosine : 2.0 * cosine * Dot(n, v) - Dot(toLight, v);
    return reflected > 0.0 ? Power(Larger(reflected, Real{}), lighting.Surface.SpecularPower)
                           : Real{};
  };
  return Reflect(lighting, facet, highlight);
}

/// Cosine between a facet's normal and the half vector, l + v (Blinn 1977); 0 without any.
template <class Real>
SURFELSPLATTING_INLINE Real HalfVectorCosine(
  const Facet<Real>& facet, const Vector3Of<Real>& toLight, const Real& cosine)
{
  const Vector3Of<Real>& v = facet.ToViewer;
  const Real length = SquareRoot(Larger(2.0 + 2.0 * Dot(toLight, v), Real{}));
  return length > 0.0 ? (cosine + Dot(facet.Normal, v)) / length : Real{};
}

/**
 * Light that a Gaussian reflects whose parts have normals of this mean. Like VTK's ray caster with
 * two-sided lighting, the side that faces the viewer is lit, a normal of 0 reflects ambient light
 * only, and the highlight is (n.h)^p, h the half vector, or (n.l)^p for a lone headlight.
 *
 * Diffuse light is linear in the normal: that of the mean is the mean. The normals that shorten the
 * mean to the length a widen the highlight: its power becomes p' = a p / (a + p (1 - a)), and its
 * peak (1 + p') / (1 + p), so that it keeps its light (Toksvig, Mipmapping Normal Maps, 2005).
 *
 * @param mean its normal has the length 0 to 1: how much the normals agree
 */
template <class Real>
SURFELSPLATTING_INLINE ShadedColor<Real> ShadeMeanNormal(
  const Lighting& lighting, const Facet<Real>& mean)
{
  const Material& material = lighting.Surface;
  const Vector3Of<Real>& n = mean.Normal;
  const Real length = Norm(n);
  const Real inverse = length > 0.0 ? 1.0 / length : Real{};
  const Real scale = Dot(n, mean.ToViewer) < 0.0 ? Real{} - inverse : inverse;
  const Facet<Real> facet{ mean.Position, { scale * n.X, scale * n.Y, scale * n.Z },
    mean.ToViewer };
  const Real agreement = length > 1.0 ? Uniform<Real>(1.0) : length; // NaN stays
  const double power = material.SpecularPower;
  // 0 for the power 0 and the normal 0, which has no highlight; short normals have hardly any.
  const Real spread = agreement + power * (1.0 - agreement);
  const Real wider = power * agreement / spread,
             fade = Smaller(4.0 * agreement, Uniform<Real>(1.0));
  const Real peak = fade * (1.0 + wider) / (1.0 + power);
  const auto highlight = [&](
                           const Light& light, const Vector3Of<Real>& toLight, const Real& cosine) {
    const Real reflected = light.LoneHeadlight ? cosine : HalfVectorCosine(facet, toLight, cosine);
    return reflected > 0.0 ? peak * Powers(Larger(reflected, Real{}), wider) : Real{};
  };
  ShadedColor<Real> shaded = Reflect(lighting, facet, highlight);
  for (int c = 0; c < 3; ++c)
  {
    const double ambient = lighting.HasSurfelColors ? material.Ambient : 0.0;
    shaded.Share[c] = ambient + agreement * (shaded.Share[c] - ambient);
  }
  return shaded;
}
}
