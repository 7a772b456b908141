// SPDX-License-Identifier: BSD-3-Clause
#include "Rendering/OpenEXR/EXRPixels.h"

#include "Core/Surfels/SurfelArrays.h"
#include "Rendering/OpenEXR/EXRChannels.h"
#include "Rendering/OpenEXR/EXRInput.h"
#include "vtkErrorCode.h"
#include "vtkFieldData.h"
#include "vtkFloatArray.h"
#include "vtkImageData.h"
#include "vtkPointData.h"
#include "vtkSmartPointer.h"
#include "vtkUnsignedIntArray.h"

#include <OpenEXR/ImfChannelList.h>
#include <OpenEXR/ImfDeepFrameBuffer.h>
#include <OpenEXR/ImfDeepScanLineInputFile.h>
#include <OpenEXR/ImfFrameBuffer.h>
#include <OpenEXR/ImfHeader.h>
#include <OpenEXR/ImfInputFile.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numeric>
#include <set>
#include <string>
#include <vector>

namespace SurfelSplatting
{
namespace
{
/// An array of the picture and the channels that become its components.
struct PixelArray
{
  std::string Name;
  std::vector<std::string> Channels;
  vtkSmartPointer<vtkFloatArray> Values;
};

vtkSmartPointer<vtkFloatArray> NewArray(const char* name, int components, vtkIdType tuples)
{
  auto array = vtkSmartPointer<vtkFloatArray>::New();
  array->SetName(name);
  array->SetNumberOfComponents(components);
  array->SetNumberOfTuples(tuples);
  return array;
}

/// Lists the arrays of a flat file, "Color" first. A name that exists already gets a trailing "_".
std::vector<PixelArray> ListArrays(const Imf::Header& header)
{
  std::set<std::string> left, taken;
  for (auto c = header.channels().begin(); c != header.channels().end(); ++c)
  {
    left.insert(c.name());
  }
  std::vector<PixelArray> arrays;
  const auto take = [&](std::string name, const std::vector<std::string>& channels) {
    for (const std::string& channel : channels)
    {
      left.erase(channel);
    }
    while (!taken.insert(name).second)
    {
      name += "_";
    }
    arrays.push_back({ name, channels, nullptr });
  };
  const int colors = NumberOfColorComponents(header);
  if (colors > 0)
  {
    const std::vector<std::string> channels{ "R", "G", "B", "A" };
    take("Color", { channels.begin(), channels.begin() + colors });
  }
  for (const NamedChannel& named : NamedChannels)
  {
    if (left.count(named.Channel))
    {
      take(named.Array, { named.Channel });
    }
  }
  for (const std::string& channel : std::set<std::string>(left))
  {
    const std::string base = channel.substr(0, channel.rfind('.'));
    const std::vector<std::string> vector{ base + ".X", base + ".Y", base + ".Z" };
    if (channel == vector[0] && left.count(vector[1]) && left.count(vector[2]))
    {
      take(ArrayOfChannel(base), vector);
    }
  }
  for (const std::string& channel : std::set<std::string>(left))
  {
    take(channel, { channel });
  }
  return arrays;
}

/// The address of column 0 for OpenEXR, whose columns begin with the data window.
template <typename Value>
char* BaseOf(Value* row, const Imf::Header& header)
{
  return reinterpret_cast<char*>(row) -
    static_cast<std::ptrdiff_t>(header.dataWindow().min.x) *
    static_cast<std::ptrdiff_t>(sizeof(Value));
}

void CopyRow(const std::vector<float>& row, vtkFloatArray* array, int component, vtkIdType first)
{
  const int components = array->GetNumberOfComponents();
  float* to = array->GetPointer(first * components + component);
  for (const float value : row)
  {
    *to = value;
    to += components;
  }
}

/// Reads the samples of a deep file row by row, in two passes: first their numbers, then the
/// samples.
class DeepRowReader
{
public:
  explicit DeepRowReader(EXRInput& input)
    : Header(input.GetHeader())
    , File(input.Rewind())
    , Counts(input.Width())
    , Channels(input.GetHeader().channels().findChannel(DeepChannels[LeastDeepChannels])
          ? MostDeepChannels
          : LeastDeepChannels)
  {
    Imf::DeepFrameBuffer frame;
    frame.insertSampleCountSlice(
      Imf::Slice(Imf::UINT, BaseOf(this->Counts.data(), this->Header), sizeof(unsigned int), 0));
    for (int c = 0; c < this->Channels; ++c)
    {
      const char* name = DeepChannels[c];
      if (!this->Header.channels().findChannel(name))
      {
        throw EXRProblem(vtkErrorCode::FileFormatError,
          std::string("the deep file has no channel ") + name + "; it must have R, G, B, A and Z.");
      }
      this->Slices[c].resize(this->Counts.size());
      frame.insert(name,
        Imf::DeepSlice(Imf::FLOAT, BaseOf(this->Slices[c].data(), this->Header), sizeof(float*), 0,
          this->Channels * sizeof(float)));
    }
    this->File.setFrameBuffer(frame);
  }

  int NumberOfChannels() const { return this->Channels; }

  /// Reads the numbers of samples of a row. Row 0 is the bottom row.
  const std::vector<unsigned int>& ReadCounts(int row)
  {
    const int y = this->Header.dataWindow().max.y - row;
    this->File.readPixelSampleCounts(y, y);
    return this->Counts;
  }

  /// Reads the samples of a row, one after another.
  void ReadSamples(int row, const unsigned int* counts, float* to)
  {
    for (std::size_t x = 0; x < this->Counts.size(); ++x)
    {
      this->Counts[x] = counts[x];
      for (int c = 0; c < this->Channels; ++c)
      {
        this->Slices[c][x] = to + c;
      }
      to += static_cast<std::size_t>(this->Channels) * counts[x];
    }
    const int y = this->Header.dataWindow().max.y - row;
    this->File.readPixels(y, y);
  }

private:
  const Imf::Header& Header;
  Imf::DeepScanLineInputFile File;
  std::vector<unsigned int> Counts;
  const int Channels;
  std::array<std::vector<float*>, MostDeepChannels> Slices;
};

/// Where T becomes one half in a sample: at its depth, or within its extent, in which the logarithm
/// of T falls evenly. @param before T in front of it
template <std::size_t Channels>
float MedianIn(const std::array<float, Channels>& sample, float before)
{
  const float extent = sample[Channels - 1] - sample[4];
  if (!(extent > 0.0f) || !std::isfinite(extent))
  {
    return sample[4];
  }
  const float share = std::log(0.5f / before) / std::log1p(-sample[3]); // 0 for opaque ones
  return sample[4] + std::min(1.0f, std::max(0.0f, share)) * extent;
}

/// Sorts the samples of a pixel and composites them to a colour and a depth.
template <std::size_t Channels>
void Flatten(std::array<float, Channels>* samples, unsigned int count, float* color, float* depth)
{
  using Sample = std::array<float, Channels>;
  // Nearest first; samples without a depth last.
  const auto isNearer = [](const Sample& a, const Sample& b) {
    return a[4] < b[4] || (std::isnan(b[4]) && !std::isnan(a[4]));
  };
  if (!std::is_sorted(samples, samples + count, isNearer))
  {
    std::stable_sort(samples, samples + count, isNearer);
  }
  std::fill_n(color, 4, 0.0f);
  *depth = 0.0f;
  float through = 1.0f;
  for (const Sample* s = samples; s != samples + count; ++s)
  {
    for (int i = 0; i < 4; ++i)
    {
      color[i] += through * (*s)[i];
    }
    const float before = through;
    through *= 1.0f - (*s)[3];
    if (before > 0.5f && through <= 0.5f)
    {
      *depth = MedianIn(*s, before);
    }
  }
}

/// What the samples of a deep file become.
struct DeepArrays
{
  vtkUnsignedIntArray* Counts; // read already
  vtkFloatArray *Samples, *Color, *Depth;
};

template <std::size_t Channels>
void ReadDeepRows(
  DeepRowReader& rows, EXRInput& input, const DeepArrays& arrays, const EXRProgress& progress)
{
  const int width = input.Width(), height = input.Height();
  auto* next = reinterpret_cast<std::array<float, Channels>*>(arrays.Samples->GetPointer(0));
  for (int row = 0; row < height; ++row)
  {
    vtkIdType pixel = static_cast<vtkIdType>(row) * width;
    const unsigned int* count = arrays.Counts->GetPointer(pixel);
    rows.ReadSamples(row, count, reinterpret_cast<float*>(next));
    for (const vtkIdType end = pixel + width; pixel < end; ++pixel, next += *count++)
    {
      Flatten<Channels>(
        next, *count, arrays.Color->GetPointer(4 * pixel), arrays.Depth->GetPointer(pixel));
    }
    progress(0.3 + 0.7 * row / height);
  }
}
}

int NumberOfColorComponents(const Imf::Header& header)
{
  const Imf::ChannelList& channels = header.channels();
  const bool isColored =
    channels.findChannel("R") && channels.findChannel("G") && channels.findChannel("B");
  return !isColored ? 0 : channels.findChannel("A") ? 4 : 3;
}

void ReadFlatPixels(EXRInput& input, vtkImageData* image, const EXRProgress& progress)
{
  const Imf::Header& header = input.GetHeader();
  const int width = input.Width(), height = input.Height();
  std::vector<PixelArray> arrays = ListArrays(header);
  std::map<std::string, std::vector<float>> rows;
  Imf::FrameBuffer frame;
  for (PixelArray& array : arrays)
  {
    array.Values = NewArray(array.Name.c_str(), static_cast<int>(array.Channels.size()),
      static_cast<vtkIdType>(width) * height);
    for (const std::string& channel : array.Channels)
    {
      std::vector<float>& row = rows[channel];
      row.resize(width);
      frame.insert(channel, Imf::Slice(Imf::FLOAT, BaseOf(row.data(), header), sizeof(float), 0));
    }
  }
  Imf::InputFile file(input.Rewind());
  file.setFrameBuffer(frame);
  for (int row = height - 1; row >= 0; --row)
  {
    file.readPixels(header.dataWindow().max.y - row);
    for (const PixelArray& array : arrays)
    {
      for (std::size_t c = 0; c < array.Channels.size(); ++c)
      {
        CopyRow(rows[array.Channels[c]], array.Values, static_cast<int>(c),
          static_cast<vtkIdType>(row) * width);
      }
    }
    progress(1.0 - static_cast<double>(row) / height);
  }
  for (const PixelArray& array : arrays)
  {
    image->GetPointData()->AddArray(array.Values);
  }
  if (NumberOfColorComponents(header) > 0)
  {
    image->GetPointData()->SetActiveScalars("Color");
  }
}

void ReadDeepPixels(EXRInput& input, vtkImageData* image, const EXRProgress& progress)
{
  const int width = input.Width(), height = input.Height();
  const vtkIdType pixels = static_cast<vtkIdType>(width) * height;
  DeepRowReader rows(input);
  auto counts = vtkSmartPointer<vtkUnsignedIntArray>::New();
  counts->SetName(Arrays::SampleCount);
  counts->SetNumberOfTuples(pixels);
  vtkIdType total = 0;
  for (int row = 0; row < height; ++row)
  {
    const std::vector<unsigned int>& read = rows.ReadCounts(row);
    std::copy(read.begin(), read.end(), counts->GetPointer(static_cast<vtkIdType>(row) * width));
    total = std::accumulate(read.begin(), read.end(), total);
    progress(0.3 * row / height);
  }
  input.CheckUnpacked(
    static_cast<double>(total) * input.BytesPerPixel(), std::to_string(total) + " samples");

  auto color = NewArray("Color", 4, pixels), depth = NewArray("Depth", 1, pixels);
  auto values = NewArray(Arrays::DeepSamples, rows.NumberOfChannels(), total);
  const DeepArrays arrays{ counts, values, color, depth };
  const bool haveExtents = rows.NumberOfChannels() == MostDeepChannels;
  haveExtents ? ReadDeepRows<MostDeepChannels>(rows, input, arrays, progress)
              : ReadDeepRows<LeastDeepChannels>(rows, input, arrays, progress);
  image->GetPointData()->SetScalars(color);
  image->GetPointData()->AddArray(depth);
  image->GetPointData()->AddArray(counts);
  image->GetFieldData()->AddArray(values);
}
}
