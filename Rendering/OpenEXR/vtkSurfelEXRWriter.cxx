// SPDX-License-Identifier: BSD-3-Clause
#include "vtkSurfelEXRWriter.h"

#include "vtkDataArray.h"
#include "vtkErrorCode.h"
#include "vtkImageData.h"
#include "vtkInformation.h"
#include "vtkInformationVector.h"
#include "vtkObjectFactory.h"
#include "vtkPointData.h"
#include "vtksys/SystemInformation.hxx"
#include "vtksys/SystemTools.hxx"

#include <OpenEXR/ImfChannelList.h>
#include <OpenEXR/ImfFrameBuffer.h>
#include <OpenEXR/ImfHeader.h>
#include <OpenEXR/ImfOutputFile.h>
#include <OpenEXR/ImfStdIO.h>

#include <cstdio>
#include <fstream>
#include <map>
#include <stdexcept>
#include <string>
#include <vector>

namespace
{
// Channels by name, each one float per pixel, top row first.
using Planes = std::map<std::string, std::vector<float>>;

// What an integer type's values are divided by.
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

/// What a path stands for, also where the file at a link's end is still to be written.
std::string FollowLinks(const std::string& path)
{
  constexpr int mostLinks = 40;
  std::string target = path, next;
  for (int i = 0; i < mostLinks && vtksys::SystemTools::FileIsSymlink(target); ++i)
  {
    if (!vtksys::SystemTools::ReadSymlink(target, next))
    {
      break;
    }
    target = vtksys::SystemTools::FileIsFullPath(next)
      ? next
      : vtksys::SystemTools::GetFilenamePath(target) +
        (target.find('/') == std::string::npos ? "" : "/") + next;
  }
  return target;
}

std::ofstream OpenForWriting(const std::string& path)
{
  std::ofstream file(path, std::ios::binary | std::ios::trunc);
  if (!file)
  {
    throw std::runtime_error("the folder does not exist or is not writable.");
  }
  return file;
}

void WriteEXR(Planes& planes, int width, int height, std::ofstream& file, const std::string& path)
{
  {
    Imf::Header header(width, height);
    header.compression() = Imf::ZIP_COMPRESSION;
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
  // OutputFile's destructor wrote the table of line offsets and swallowed what went wrong there.
  file.close();
  if (!file)
  {
    throw std::runtime_error("writing failed; is the disk full?");
  }
}
}

//------------------------------------------------------------------------------
struct vtkSurfelEXRWriter::Internals
{
  std::vector<std::pair<std::string, std::string>> Channels; // array, channel

  // Throws std::runtime_error where the input does not have what is to be written.
  Planes CollectPlanes(vtkImageData* image, int width, int height) const;
};

//------------------------------------------------------------------------------
Planes vtkSurfelEXRWriter::Internals::CollectPlanes(
  vtkImageData* image, int width, int height) const
{
  vtkDataArray* colors = image->GetPointData()->GetScalars();
  const int components = colors ? colors->GetNumberOfComponents() : 0;
  if (components != 3 && components != 4)
  {
    throw std::runtime_error(
      "the picture's scalars must have 3 or 4 components, not " + std::to_string(components) + ".");
  }
  Planes planes;
  const double largest = LargestValue(colors);
  for (int i = 0; i < components; ++i)
  {
    planes[std::string(1, "RGBA"[i])] = TopDownPlane(colors, i, width, height, largest);
  }
  for (const auto& channel : this->Channels)
  {
    vtkDataArray* array = image->GetPointData()->GetArray(channel.first.c_str());
    if (!array || array->GetNumberOfComponents() != 1)
    {
      throw std::runtime_error("the picture has no point array " + channel.first +
        " of one component for channel " + channel.second + ".");
    }
    planes[channel.second] = TopDownPlane(array, 0, width, height, 1.0);
  }
  return planes;
}

//------------------------------------------------------------------------------
vtkStandardNewMacro(vtkSurfelEXRWriter);

//------------------------------------------------------------------------------
vtkSurfelEXRWriter::vtkSurfelEXRWriter()
  : Internal(new Internals)
{
}

//------------------------------------------------------------------------------
vtkSurfelEXRWriter::~vtkSurfelEXRWriter() = default;

//------------------------------------------------------------------------------
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

//------------------------------------------------------------------------------
void vtkSurfelEXRWriter::RemoveAllChannels()
{
  this->Internal->Channels.clear();
  this->Modified();
}

//------------------------------------------------------------------------------
int vtkSurfelEXRWriter::GetNumberOfChannels()
{
  return static_cast<int>(this->Internal->Channels.size());
}

//------------------------------------------------------------------------------
void vtkSurfelEXRWriter::Write()
{
  this->SetErrorCode(vtkErrorCode::NoError);
  if (this->GetNumberOfInputConnections(0) == 0)
  {
    this->SetErrorCode(vtkErrorCode::UnknownError);
    vtkErrorMacro("No picture to write: set the input first.");
    return;
  }
  // Written anew at every call, whether or not the input has changed.
  this->Modified();
  this->UpdateWholeExtent();
}

//------------------------------------------------------------------------------
int vtkSurfelEXRWriter::RequestData(
  vtkInformation*, vtkInformationVector** inputVector, vtkInformationVector*)
{
  this->SetErrorCode(vtkErrorCode::NoError);
  if (!this->FileName || !*this->FileName)
  {
    this->SetErrorCode(vtkErrorCode::NoFileNameError);
    vtkErrorMacro("No file to write: call SetFileName first.");
    return 0;
  }
  vtkImageData* image = vtkImageData::GetData(inputVector[0]);
  const int* size = image->GetDimensions();
  if (size[0] < 1 || size[1] < 1 || size[2] != 1)
  {
    this->SetErrorCode(vtkErrorCode::UnknownError);
    vtkErrorMacro("Cannot write " << this->FileName << ": the picture is " << size[0] << " x "
                                  << size[1] << " x " << size[2] << ", not one plane of pixels.");
    return 0;
  }

  vtksys::SystemInformation system;
  // What a link points to is written; the link stays.
  const std::string target = FollowLinks(this->FileName);
  const std::string temporary = target + "." + std::to_string(system.GetProcessId()) + ".part";
  unsigned long problemCode = vtkErrorCode::UnknownError;
  try
  {
    Planes planes = this->Internal->CollectPlanes(image, size[0], size[1]);
    problemCode = vtkErrorCode::CannotOpenFileError;
    std::ofstream file = OpenForWriting(temporary);
    problemCode = vtkErrorCode::OutOfDiskSpaceError;
    WriteEXR(planes, size[0], size[1], file, temporary);
    problemCode = vtkErrorCode::CannotOpenFileError;
    if (std::rename(temporary.c_str(), target.c_str()) != 0)
    {
      throw std::runtime_error(vtksys::SystemTools::GetLastSystemError());
    }
  }
  catch (const std::exception& problem)
  {
    std::remove(temporary.c_str());
    this->SetErrorCode(problemCode);
    vtkErrorMacro("Cannot write " << this->FileName << ": " << problem.what());
    return 0;
  }
  return 1;
}

//------------------------------------------------------------------------------
void vtkSurfelEXRWriter::PrintSelf(ostream& os, vtkIndent indent)
{
  this->Superclass::PrintSelf(os, indent);
  for (const auto& channel : this->Internal->Channels)
  {
    os << indent << "Channel: " << channel.second << " from " << channel.first << "\n";
  }
}
