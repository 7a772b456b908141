// SPDX-License-Identifier: BSD-3-Clause
// DumpEXR FILE: the file's size, compression, deepImageState (deep files only; -1: none) and
// channels as one line of text, then raw 32-bit numbers, top row first. A flat file: the channels'
// values as floats, one channel after the other. A deep file of scan lines: each pixel's number of
// samples, then the samples as floats, one channel after the other. Fails if OpenEXR finds the file
// broken.
#include <OpenEXR/ImfChannelList.h>
#include <OpenEXR/ImfCheckFile.h>
#include <OpenEXR/ImfDeepFrameBuffer.h>
#include <OpenEXR/ImfDeepScanLineInputFile.h>
#include <OpenEXR/ImfFrameBuffer.h>
#include <OpenEXR/ImfHeader.h>
#include <OpenEXR/ImfInputFile.h>
#include <OpenEXR/ImfStandardAttributes.h>
#include <OpenEXR/ImfTestFile.h>

#include <iostream>
#include <numeric>
#include <vector>

namespace
{
struct Size
{
  explicit Size(const Imf::Header& header)
    : Width(header.dataWindow().max.x - header.dataWindow().min.x + 1)
    , Height(header.dataWindow().max.y - header.dataWindow().min.y + 1)
    , Pixels(static_cast<std::size_t>(this->Width) * this->Height)
  {
  }

  int Width, Height;
  std::size_t Pixels;
};

void WriteHeader(const Imf::Header& header, bool deep)
{
  const Size size(header);
  std::cout << size.Width << " " << size.Height << " " << header.compression();
  if (deep)
  {
    std::cout << " "
              << (Imf::hasDeepImageState(header) ? static_cast<int>(Imf::deepImageState(header))
                                                 : -1);
  }
  const Imf::ChannelList& channels = header.channels();
  for (auto channel = channels.begin(); channel != channels.end(); ++channel)
  {
    std::cout << " " << channel.name() << ":" << channel.channel().type;
  }
  std::cout << "\n";
}

template <class Number>
void Write(const std::vector<Number>& numbers)
{
  std::cout.write(reinterpret_cast<const char*>(numbers.data()),
    static_cast<std::streamsize>(numbers.size() * sizeof(Number)));
}

void DumpFlat(const char* name)
{
  Imf::InputFile file(name);
  WriteHeader(file.header(), false);
  const Size size(file.header());
  const auto window = file.header().dataWindow();
  const Imf::ChannelList& channels = file.header().channels();
  std::vector<std::vector<float>> planes;
  Imf::FrameBuffer frame;
  for (auto channel = channels.begin(); channel != channels.end(); ++channel)
  {
    planes.emplace_back(size.Pixels);
    frame.insert(channel.name(),
      Imf::Slice::Make(
        Imf::FLOAT, planes.back().data(), window, sizeof(float), sizeof(float) * size.Width));
  }
  file.setFrameBuffer(frame);
  file.readPixels(window.min.y, window.max.y);
  for (const std::vector<float>& plane : planes)
  {
    Write(plane);
  }
}

void DumpDeep(const char* name)
{
  Imf::DeepScanLineInputFile file(name);
  WriteHeader(file.header(), true);
  const Size size(file.header());
  const auto window = file.header().dataWindow();
  const Imf::ChannelList& channels = file.header().channels();
  std::vector<unsigned int> counts(size.Pixels);
  Imf::DeepFrameBuffer frame;
  frame.insertSampleCountSlice(Imf::Slice(Imf::UINT, reinterpret_cast<char*>(counts.data()),
    sizeof(unsigned int), sizeof(unsigned int) * size.Width));
  std::vector<std::vector<float*>> pointers;
  for (auto channel = channels.begin(); channel != channels.end(); ++channel)
  {
    pointers.emplace_back(size.Pixels);
    frame.insert(channel.name(),
      Imf::DeepSlice(Imf::FLOAT, reinterpret_cast<char*>(pointers.back().data()), sizeof(float*),
        sizeof(float*) * size.Width, sizeof(float)));
  }
  file.setFrameBuffer(frame);
  file.readPixelSampleCounts(window.min.y, window.max.y);
  const std::size_t samples = std::accumulate(counts.begin(), counts.end(), std::size_t{ 0 });
  std::vector<std::vector<float>> values(pointers.size(), std::vector<float>(samples));
  for (std::size_t c = 0; c < pointers.size(); ++c)
  {
    float* next = values[c].data();
    for (std::size_t p = 0; p < size.Pixels; ++p)
    {
      pointers[c][p] = next;
      next += counts[p];
    }
  }
  file.readPixels(window.min.y, window.max.y);
  Write(counts);
  for (const std::vector<float>& channel : values)
  {
    Write(channel);
  }
}
}

int main(int argc, char** argv)
{
  if (argc != 2 || Imf::checkOpenEXRFile(argv[1])) // true: broken
  {
    std::cerr << "not a sound OpenEXR file\n";
    return 1;
  }
  Imf::isDeepOpenExrFile(argv[1]) ? DumpDeep(argv[1]) : DumpFlat(argv[1]);
  return std::cout.good() ? 0 : 1;
}
