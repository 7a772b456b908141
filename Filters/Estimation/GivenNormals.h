// SPDX-License-Identifier: BSD-3-Clause
/**
 * Whether normals that come with the points are those of the surface that the points are on.
 *
 * Many programs write normals whose signs are chance, or differ from patch to patch; others keep
 * those of another frame, or none at all under that name. A wrong sign is a hole in the picture. So
 * a sample of the points is looked at whose neighbours lie in a plane: normals must be across it,
 * and those of neighbours on one side of it.
 */
#pragma once

#include <vector>

namespace SurfelGeometry
{
struct SearchedCloud;

/// What is to be made of given normals, from good to bad.
enum class NormalsUse
{
  None, // there are none
  Kept,
  WithoutSides, // they are across the surface, but their signs do not tell what is outside
  Dropped
};

/// What to make of the normals of a cloud that is not empty.
/// @param given [3n] unit vectors, (0, 0, 0) where a point has none
NormalsUse JudgeNormals(const SearchedCloud& searched, const std::vector<float>& given);
}
