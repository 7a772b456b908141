// SPDX-License-Identifier: BSD-3-Clause
#include "vtkSurfelEXRWriter.h"

#include "Rendering/OpenEXR/EXRCamera.h"
#include "Rendering/OpenEXR/EXRChannels.h"
#include "vtkDataArray.h"
#include "vtkImageData.h"
#include "vtkObjectFactory.h"
#include "vtkPointData.h"

#include <OpenEXR/ImfChannelList.h>
#include <OpenEXR/ImfFrameBuffer.h>
#include <OpenEXR/ImfHeader.h>
#include <OpenEXR/ImfOutputFile.h>
#include <OpenEXR/ImfStdIO.h>

#include <fstream>
#include <map>
#include <set>
#include <stdexcept>
#include <string>
#include <vector>

namespace
{
// Channels by name: one float per pixel, top row first.
using Planes = std::map<std::string, std::vector<float>>;

// The divisor for values: the largest value of an integer type, otherwise 1.
double LargestValue(vtkDataArray* array)
{
  const bool isReal = array->GetDataType() == VTK_FLOAT || array->GetDataType() == VTK_DOUBLE;
  return isReal ? 1.0 : array->GetDataTypeMax();
}

std::vector<float> TopDownPlane(
  vtkDataArray* array, int component, int width, int height, double largest)
{
  std::vector<float> plane(static_cast<std::size_t>(width) * height);
  std::size_t to = 0;
  for (int row = height - 1; row >= 0; --row)
  {
    const vtkIdType first = static_cast<vtkIdType>(row) * width;
    for (vtkIdType pixel = first; pixel < first + width; ++pixel)
    {
      plane[to++] = static_cast<float>(array->GetComponent(pixel, component) / largest);
    }
  }
  return plane;
}

bool IsChannel(vtkDataArray* array, vtkIdType pixels)
{
  const int components = array->GetNumberOfComponents();
  return (components == 1 || components == 3) && array->GetNumberOfTuples() == pixels;
}

void AddPlane(
  const std::string& channel, vtkDataArray* array, int component, const int* size, Planes& planes)
{
  if (!planes.emplace(channel, TopDownPlane(array, component, size[0], size[1], 1.0)).second)
  {
    throw std::runtime_error("point array " + std::string(array->GetName()) +
      " would be a second channel " + channel + ": rename it, or add channels one by one.");
  }
}

void AddPlanes(vtkDataArray* array, const std::string& channel, const int* size, Planes& planes)
{
  if (array->GetNumberOfComponents() == 1)
  {
    AddPlane(channel, array, 0, size, planes);
    return;
  }
  for (int i = 0; i < 3; ++i)
  {
    AddPlane(channel + "." + "XYZ"[i], array, i, size, planes);
  }
}

void WriteEXR(vtkImageData* image, Planes& planes, int width, int height, std::ofstream& file,
  const std::string& path)
{
  Imf::Header header(width, height);
  header.compression() = Imf::ZIP_COMPRESSION;
  SurfelSplatting::WriteCamera(image, header);
  Imf::FrameBuffer frame;
  for (auto& plane : planes)
  {
    header.channels().insert(plane.first, Imf::Channel(Imf::FLOAT));
    frame.insert(plane.first,
      Imf::Slice(Imf::FLOAT, reinterpret_cast<char*>(plane.second.data()), sizeof(float),
        sizeof(float) * width));
  }
  Imf::StdOFStream stream(file, path.c_str());
  Imf::OutputFile output(stream, header);
  output.setFrameBuffer(frame);
  output.writePixels(height);
}
}

struct vtkSurfelEXRWriter::Internals
{
  std::vector<std::pair<std::string, std::string>> Channels; // array, channel

  // Throws std::runtime_error if the input does not have what is to be written.
  Planes CollectPlanes(vtkImageData* image, bool allChannels) const;
};

Planes vtkSurfelEXRWriter::Internals::CollectPlanes(vtkImageData* image, bool allChannels) const
{
  vtkPointData* data = image->GetPointData();
  vtkDataArray* colors = data->GetScalars();
  const int components = colors ? colors->GetNumberOfComponents() : 0;
  if (components != 3 && components != 4)
  {
    throw std::runtime_error(
      "the picture's scalars must have 3 or 4 components, not " + std::to_string(components) + ".");
  }
  const vtkIdType pixels = image->GetNumberOfPoints();
  if (colors->GetNumberOfTuples() != pixels)
  {
    throw std::runtime_error("the picture's scalars do not have a value for each pixel.");
  }
  const int* size = image->GetDimensions();
  Planes planes;
  const double largest = LargestValue(colors);
  for (int i = 0; i < components; ++i)
  {
    planes[std::string(1, "RGBA"[i])] = TopDownPlane(colors, i, size[0], size[1], largest);
  }
  std::set<vtkDataArray*> added{ colors };
  for (const auto& channel : this->Channels)
  {
    vtkDataArray* array = data->GetArray(channel.first.c_str());
    if (!array || !IsChannel(array, pixels))
    {
      throw std::runtime_error("the picture has no point array " + channel.first +
        " of one or three components, and a value for each pixel, for channel " + channel.second +
        ".");
    }
    AddPlanes(array, channel.second, size, planes);
    added.insert(array);
  }
  for (int i = 0; allChannels && i < data->GetNumberOfArrays(); ++i)
  {
    vtkDataArray* array = data->GetArray(i);
    if (array && array->GetName() && IsChannel(array, pixels) && added.insert(array).second)
    {
      AddPlanes(array, SurfelSplatting::ChannelOfArray(array->GetName()), size, planes);
    }
  }
  return planes;
}

vtkStandardNewMacro(vtkSurfelEXRWriter);

vtkSurfelEXRWriter::vtkSurfelEXRWriter()
  : Internal(new Internals)
{
}

vtkSurfelEXRWriter::~vtkSurfelEXRWriter() = default;

void vtkSurfelEXRWriter::AddChannel(const char* arrayName, const char* channelName)
{
  const std::string channel = channelName ? channelName : "";
  if (!arrayName || channel.empty() ||
    (channel.size() == 1 && std::string("RGBA").find(channel) != std::string::npos))
  {
    vtkErrorMacro("Cannot add channel \"" << channel << "\": give an array's name and a channel's "
                                          << "name other than R, G, B and A.");
    return;
  }
  this->Internal->Channels.emplace_back(arrayName, channel);
  this->Modified();
}

void vtkSurfelEXRWriter::RemoveAllChannels()
{
  this->Internal->Channels.clear();
  this->Modified();
}

int vtkSurfelEXRWriter::GetNumberOfChannels()
{
  return static_cast<int>(this->Internal->Channels.size());
}

void vtkSurfelEXRWriter::WriteStream(
  vtkImageData* image, std::ofstream& file, const std::string& path)
{
  const int* size = image->GetDimensions();
  Planes planes = this->Internal->CollectPlanes(image, this->AllChannels != 0);
  WriteEXR(image, planes, size[0], size[1], file, path);
}

void vtkSurfelEXRWriter::PrintSelf(ostream& os, vtkIndent indent)
{
  this->Superclass::PrintSelf(os, indent);
  os << indent << "AllChannels: " << this->AllChannels << "\n";
  for (const auto& channel : this->Internal->Channels)
  {
    os << indent << "Channel: " << channel.second << " from " << channel.first << "\n";
  }
}
