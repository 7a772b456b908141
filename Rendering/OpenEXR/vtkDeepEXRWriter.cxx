// SPDX-License-Identifier: BSD-3-Clause
#include "vtkDeepEXRWriter.h"

#include "Core/Surfels/SurfelArrays.h"
#include "Rendering/OpenEXR/EXRCamera.h"
#include "Rendering/OpenEXR/EXRChannels.h"
#include "vtkDataArray.h"
#include "vtkFieldData.h"
#include "vtkFloatArray.h"
#include "vtkImageData.h"
#include "vtkObjectFactory.h"
#include "vtkPointData.h"

#include <OpenEXR/ImfChannelList.h>
#include <OpenEXR/ImfDeepFrameBuffer.h>
#include <OpenEXR/ImfDeepScanLineOutputFile.h>
#include <OpenEXR/ImfHeader.h>
#include <OpenEXR/ImfPartType.h>
#include <OpenEXR/ImfStandardAttributes.h>
#include <OpenEXR/ImfStdIO.h>

#include <array>
#include <fstream>
#include <stdexcept>
#include <string>
#include <vector>

namespace Arrays = SurfelSplatting::Arrays;

namespace
{
using SurfelSplatting::DeepChannels;
using SurfelSplatting::LeastDeepChannels;
using SurfelSplatting::MostDeepChannels;

/// The samples of an image, row by row.
class DeepSampleRows
{
public:
  /// Throws std::runtime_error if the image has no samples or its arrays contradict each other.
  explicit DeepSampleRows(vtkImageData* image)
    : Width(image->GetDimensions()[0])
    , Height(image->GetDimensions()[1])
    , Counts(image->GetPointData()->GetArray(Arrays::SampleCount))
    , Samples(vtkFloatArray::SafeDownCast(image->GetFieldData()->GetArray(Arrays::DeepSamples)))
  {
    if (!this->Counts || this->Counts->GetNumberOfComponents() != 1 || !this->Samples ||
      this->NumberOfChannels() < LeastDeepChannels || this->NumberOfChannels() > MostDeepChannels)
    {
      throw std::runtime_error(
        "the picture has no deep samples (point array SampleCount, field data array DeepSamples of "
        "5 or 6 floats): switch them on with GetSplatter()->DeepSamplesOn().");
    }
    const vtkIdType pixels = image->GetNumberOfPoints();
    if (this->Counts->GetNumberOfTuples() != pixels)
    {
      throw std::runtime_error("SampleCount has " +
        std::to_string(this->Counts->GetNumberOfTuples()) + " values for " +
        std::to_string(pixels) + " pixels.");
    }
    this->Firsts.push_back(0);
    for (vtkIdType pixel = 0; pixel < pixels; ++pixel)
    {
      this->Firsts.push_back(this->Firsts.back() + this->Count(pixel));
    }
    if (this->Firsts.back() != this->Samples->GetNumberOfTuples())
    {
      throw std::runtime_error("SampleCount sums to " + std::to_string(this->Firsts.back()) +
        ", but DeepSamples has " + std::to_string(this->Samples->GetNumberOfTuples()) + " tuples.");
    }
  }

  vtkIdType NumberOfSamples() const { return this->Firsts.back(); }
  int NumberOfChannels() const { return this->Samples->GetNumberOfComponents(); }

  /// Points the slices of a row to its samples.
  void Get(int row, std::vector<unsigned int>& counts,
    std::array<std::vector<float*>, MostDeepChannels>& slices) const
  {
    const int channels = this->NumberOfChannels();
    for (int x = 0; x < this->Width; ++x)
    {
      const vtkIdType pixel = static_cast<vtkIdType>(row) * this->Width + x;
      counts[x] = static_cast<unsigned int>(this->Firsts[pixel + 1] - this->Firsts[pixel]);
      for (int c = 0; c < channels; ++c)
      {
        slices[c][x] = this->Samples->GetPointer(channels * this->Firsts[pixel]) + c;
      }
    }
  }

  const int Width, Height;

private:
  /// Throws std::runtime_error if it is none.
  vtkIdType Count(vtkIdType pixel) const
  {
    const double count = this->Counts->GetComponent(pixel, 0);
    if (!(count >= 0.0 && count <= static_cast<double>(this->Samples->GetNumberOfTuples())))
    {
      throw std::runtime_error("SampleCount has the value " + std::to_string(count) +
        ", which is no part of the " + std::to_string(this->Samples->GetNumberOfTuples()) +
        " tuples of DeepSamples.");
    }
    return static_cast<vtkIdType>(count);
  }

  vtkDataArray* Counts;
  vtkFloatArray* Samples;
  std::vector<vtkIdType> Firsts; // [pixels + 1]
};

Imf::Header MakeHeader(vtkImageData* image, int numberOfChannels, bool declareTidy)
{
  const int* size = image->GetDimensions();
  Imf::Header header(size[0], size[1]);
  header.setType(Imf::DEEPSCANLINE);
  header.compression() = Imf::ZIPS_COMPRESSION;
  for (int c = 0; c < numberOfChannels; ++c)
  {
    header.channels().insert(DeepChannels[c], Imf::Channel(Imf::FLOAT));
  }
  if (declareTidy)
  {
    Imf::addDeepImageState(header, Imf::DIS_TIDY);
  }
  SurfelSplatting::WriteCamera(image, header);
  return header;
}
}

vtkStandardNewMacro(vtkDeepEXRWriter);

vtkDeepEXRWriter::vtkDeepEXRWriter() = default;
vtkDeepEXRWriter::~vtkDeepEXRWriter() = default;

void vtkDeepEXRWriter::WriteStream(
  vtkImageData* image, std::ofstream& file, const std::string& path)
{
  this->NumberOfSamples = 0;
  const DeepSampleRows rows(image);
  Imf::StdOFStream stream(file, path.c_str());
  const int channels = rows.NumberOfChannels();
  Imf::DeepScanLineOutputFile output(
    stream, MakeHeader(image, channels, this->DeepImageState != 0));
  // One row at a time: all rows use the same memory.
  std::vector<unsigned int> counts(rows.Width);
  std::array<std::vector<float*>, MostDeepChannels> slices;
  Imf::DeepFrameBuffer frame;
  frame.insertSampleCountSlice(
    Imf::Slice(Imf::UINT, reinterpret_cast<char*>(counts.data()), sizeof(unsigned int), 0));
  for (int c = 0; c < channels; ++c)
  {
    slices[c].resize(rows.Width);
    frame.insert(DeepChannels[c],
      Imf::DeepSlice(Imf::FLOAT, reinterpret_cast<char*>(slices[c].data()), sizeof(float*), 0,
        channels * sizeof(float)));
  }
  output.setFrameBuffer(frame);
  for (int row = rows.Height - 1; row >= 0; --row)
  {
    rows.Get(row, counts, slices);
    output.writePixels(1);
  }
  this->NumberOfSamples = rows.NumberOfSamples();
}

void vtkDeepEXRWriter::PrintSelf(ostream& os, vtkIndent indent)
{
  this->Superclass::PrintSelf(os, indent);
  os << indent << "DeepImageState: " << this->DeepImageState << "\n";
  os << indent << "NumberOfSamples: " << this->NumberOfSamples << "\n";
}
