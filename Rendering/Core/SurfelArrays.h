// SPDX-License-Identifier: BSD-3-Clause
/**
 * Names of the point and field arrays that carry surfels between filters and renderer.
 * Components, units and ranges: Documentation/DataContract.md.
 */
#pragma once

namespace SurfelSplatting
{
namespace Arrays
{
constexpr const char* Origin = "SurfelOrigin";         // field data, double[3], world units
constexpr const char* Covariance = "SurfelCovariance"; // float[6], XX YY ZZ XY YZ XZ
constexpr const char* AreaVector = "SurfelAreaVector"; // float[3], outward, world units squared
constexpr const char* TwoSided = "SurfelTwoSided";     // unsigned char[1], 0 or 1
constexpr const char* Opacity = "SurfelOpacity";       // float[1], 0..1

// Of a hierarchy:
constexpr const char* Leaves = "SurfelLeaves"; // field data, id[2]: one-sided, two-sided leaves
constexpr const char* Area = "SurfelArea";     // float[1], sum of the leaves' areas
constexpr const char* LeafCovariance = "SurfelLeafCovariance"; // float[6], mean of the leaves'
constexpr const char* Bound =
  "SurfelBound";                           // float[1], radius of a sphere with all leaves' centres
constexpr const char* Cone = "SurfelCone"; // float[1], cosine of a cone with all leaves' normals
constexpr const char* Level = "SurfelLevel"; // unsigned char[1], 0 = leaf
}
}
