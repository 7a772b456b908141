// SPDX-License-Identifier: BSD-3-Clause
// Cells of an image are smooth unless there is a step, or nothing, within a cell of them.
#include "Core/Splats/SmoothCells.h"
#include "TestScene.h"
#include "Testing/Shared/Check.h"

#include <algorithm>
#include <cstddef>
#include <cstdlib>
#include <vector>

using namespace SurfelSplatting;

namespace
{
constexpr int Width = 41, Height = 30; // an odd column is in no cell

struct Image
{
  std::vector<float> Colors = std::vector<float>(4 * Width * Height, 0.5f);
  std::vector<float> Nearness = std::vector<float>(Width * Height, 20.0f);
  std::vector<float> Confusions = std::vector<float>(Width * Height, 8.0f);

  SmoothCells Find() const
  {
    SmoothCells cells;
    cells.Find(
      { Width, Height, this->Colors.data(), this->Nearness.data(), this->Confusions.data() },
      SerialExecutor());
    return cells;
  }

  /// Whether the cells that are not smooth are those within one of the cell of a pixel, and those
  /// at the border.
  bool IsRoughAbout(int px, int py) const
  {
    const SmoothCells cells = this->Find();
    bool is = true;
    for (int y = 0; y < Height / 2; ++y)
    {
      for (int x = 0; x < Width / 2; ++x)
      {
        const bool border = x == 0 || y == 0 || x + 1 == Width / 2 || y + 1 == Height / 2;
        const bool near = std::abs(x - px / 2) <= 1 && std::abs(y - py / 2) <= 1;
        is = is && cells.Has(2 * x, 2 * y, 2) == !(border || near);
      }
    }
    return is;
  }
};

TEST_CASE("One pixel differs")
{
  const std::size_t pixel = 13 * Width + 21;
  for (int c = 0; c < 4; ++c)
  {
    Image image;
    image.Colors[4 * pixel + c] += 1.1f * SmoothCells::MaxColorRange;
    CHECK(image.IsRoughAbout(21, 13));
  }
  Image deep, hole;
  deep.Nearness[pixel] -= 1.1f * SmoothCells::MaxNearnessRange;
  CHECK(deep.IsRoughAbout(21, 13));
  hole.Confusions[pixel] = -1.0f;
  CHECK(hole.IsRoughAbout(21, 13));
}

/// Gradients are smooth if six pixels change by less than the range. Squares are if all cells are.
TEST_CASE("Gradients and squares")
{
  for (const float steep : { 0.9f, 1.1f })
  {
    Image image;
    for (std::size_t p = 0; p < image.Nearness.size(); ++p)
    {
      image.Colors[4 * p] =
        steep * SmoothCells::MaxColorRange / 5.0f * static_cast<float>(p % Width);
    }
    CHECK(image.Find().Has(8, 8, 4) == (steep < 1.0f));
  }
  Image image;
  CHECK(image.Find().Has(8, 8, 4));
  image.Colors[4 * (8 * Width + 13)] = 0.0f; // beside the square
  CHECK(!image.Find().Has(8, 8, 4));
  CHECK(image.Find().Has(4, 8, 4));
}

/// Images that are too small for a cell with neighbours have no smooth ones.
TEST_CASE("Small images")
{
  const float values[16] = { 0 };
  SmoothCells cells;
  cells.Find({ 2, 2, values, values, values }, SerialExecutor());
  CHECK(!cells.Has(0, 0, 2));
}
}
