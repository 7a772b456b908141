// SPDX-License-Identifier: BSD-3-Clause
// Plain arrays of points, normals and colours -> picture with depth of field, without VTK.
#include "Core/Base/ThreadExecutor.h"
#include "Core/Picture/Splatter.h"
#include "Core/Surfels/RoundSurfels.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <thread>
#include <vector>

using namespace SurfelSplatting;

namespace
{
struct Points
{
  std::vector<float> Positions, Normals;
  std::vector<unsigned char> Colors; // RGBA
};

/// Points of a sphere on a spiral, which spreads them evenly.
void AddSphere(const Vector3& center, const unsigned char* color, int count, Points& points)
{
  const double turn = Pi * (3.0 - std::sqrt(5.0)); // the golden angle
  for (int i = 0; i < count; ++i)
  {
    const double y = 1.0 - 2.0 * (i + 0.5) / count, radius = std::sqrt(1.0 - y * y);
    const double normal[3] = { radius * std::cos(turn * i), y, radius * std::sin(turn * i) };
    for (int k = 0; k < 3; ++k)
    {
      points.Positions.push_back(static_cast<float>(center[k] + normal[k]));
      points.Normals.push_back(static_cast<float>(normal[k]));
    }
    points.Colors.insert(points.Colors.end(), color, color + 4);
  }
}

/// Writes a picture over black: frames have their bottom row first, PPM files their top row.
bool WritePPM(const Frame& frame, const char* path)
{
  std::FILE* file = std::fopen(path, "wb");
  if (!file)
  {
    return false;
  }
  std::fprintf(file, "P6 %d %d 255\n", frame.Width, frame.Height);
  for (int y = frame.Height - 1; y >= 0; --y)
  {
    for (int i = 0; i < 4 * frame.Width; ++i)
    {
      if (i % 4 != 3) // not alpha
      {
        const float value = frame.Color[static_cast<std::size_t>(y) * 4 * frame.Width + i];
        std::fputc(static_cast<int>(std::clamp(value, 0.0f, 1.0f) * 255.0f + 0.5f), file);
      }
    }
  }
  return std::fclose(file) == 0;
}
}

int main(int argc, char** argv)
{
  constexpr int width = 640, height = 360, count = 20000;
  const unsigned char colors[3][4] = { { 230, 120, 60, 255 }, { 90, 190, 110, 255 },
    { 80, 130, 230, 255 } };
  Points points; // three spheres of radius 1, one behind the other
  for (int i = 0; i < 3; ++i)
  {
    AddSphere({ 1.6 * (i - 1), 0, -3.0 * i }, colors[i], count, points);
  }

  const double spacing = std::sqrt(4.0 * Pi / count); // each point's share of its sphere's area
  const RoundSurfels surfels(3 * count, points.Positions.data(), points.Normals.data(), spacing);
  SurfelCloud cloud = surfels.Cloud();
  cloud.ColorsUChar = points.Colors.data();
  cloud.Surface.Lit = true;

  SplatContext context;
  context.Camera = LookAt({ 0, 1, 8 }, { 0, 0, -3 }, { 0, 1, 0 }, 30, width, height);
  context.Optics.Radius = 0.25;        // of the lens, world units; 0: everything is sharp
  context.Optics.FocalDistance = 10.2; // in focus: the front of the sphere in the middle
  context.Lights.resize(1);            // from the camera
  context.Lights[0].LoneHeadlight = true;

  std::vector<float> color(4 * width * height), depth(width * height);
  const Frame frame{ width, height, color.data(), depth.data() };
  Splatter splatter;
  splatter.Render(context, { cloud }, ThreadExecutor(std::thread::hardware_concurrency()), frame);
  const char* path = argc > 1 ? argv[1] : "spheres.ppm";
  if (!WritePPM(frame, path))
  {
    std::fprintf(stderr, "%s cannot be written\n", path);
    return 1;
  }
  std::printf(
    "%s: %llu splats\n", path, static_cast<unsigned long long>(splatter.Statistics().Splats));
  return 0;
}
