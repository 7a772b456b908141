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
constexpr const char* Overlap = "SurfelOverlap";       // unsigned char[1], unit 1 / 255
constexpr const char* Opacity = "SurfelOpacity";       // float[1], 0..1

// Of Gaussians in space (Documentation/Volumes.md); the first marks such a cloud:
constexpr const char* GaussianCovariance = "GaussianCovariance"; // float[6], XX YY ZZ XY YZ XZ
constexpr const char* GaussianOpacity = "GaussianOpacity"; // float[1], 0..1, at the centre; or
constexpr const char* GaussianExtinction = "GaussianExtinction"; // float[1], per world unit, there
constexpr const char* GaussianNormal = "GaussianNormal";       // float[3], mean normal, length 0..1
constexpr const char* GaussianHarmonics = "GaussianHarmonics"; // float[3 K]: K coefficients of
                                                               // red, green, blue; K = 1, 4, 9, 16

// In a picture:
constexpr const char* SampleCount = "SampleCount";     // point data, unsigned int[1]: deep samples
constexpr const char* DeepSamples = "DeepSamples";     // field data, float[5]: R G B A depth, or
                                                       // float[6]: and where the sample ends
constexpr const char* WorldToCamera = "WorldToCamera"; // field data, double[16], row by row
constexpr const char* CameraLens = "CameraLens"; // field data, double[3]: focal length in px, lens
                                                 // diameter and distance in focus in world units
constexpr const char* ScreenWindow = "ScreenWindow"; // field data, double[3]: centre x, y (up) and
                                                     // width at distance 1 along the view direction
// In a picture with vtkSurfelSplatter::Channels, point data:
constexpr const char* Normal = "Normal";                       // float[3], world, unit length
constexpr const char* CircleOfConfusion = "CircleOfConfusion"; // float[1], px, < 0 before the focus
constexpr const char* Coverage = "Coverage";                   // float[1], 0..1
constexpr const char* Fragments = "Fragments";                 // float[1]
constexpr const char* Level = "Level";                         // float[1], of the hierarchy
constexpr const char* MedianDepth = "MedianDepth";             // float[1], at half of alpha

// In a hierarchy:
constexpr const char* Leaves = "SurfelLeaves"; // field data, id[2]: one-sided, two-sided leaves
constexpr const char* Nodes = "SurfelNodes";   // field data, unsigned char[48]: HierarchyNode

// In a hierarchy from a file, field data, so that the first frame need not compute them:
constexpr const char* Clusters = "SurfelClusters";      // unsigned char[44]: ClusterBounds::Node
constexpr const char* Extents = "SurfelClusterExtents"; // unsigned char[72]: NodeExtent[6]
constexpr const char* NodeColors = "SurfelNodeColors";  // unsigned char[36]: NodeColor
constexpr const char* Samples = "SurfelSamples";        // float[13]: some of the surfels
constexpr const char* Bounds = "SurfelBounds";          // double[6]
constexpr const char* Computed[] = { Clusters, Extents, NodeColors, Samples, Bounds };
}
}
