// SPDX-License-Identifier: BSD-3-Clause
// DumpDeepEXR FILE: of a file of deep scan lines, its window, compression, deepImageState (-1 where
// it says none) and channels as one line of text, then the pixels' numbers of samples as raw 32-bit
// integers, top row first, then the samples as raw 32-bit floats, channel by channel. Fails where
// OpenEXR finds the file broken.
#include <OpenEXR/ImfChannelList.h>
#include <OpenEXR/ImfCheckFile.h>
#include <OpenEXR/ImfDeepFrameBuffer.h>
#include <OpenEXR/ImfDeepScanLineInputFile.h>
#include <OpenEXR/ImfHeader.h>
#include <OpenEXR/ImfStandardAttributes.h>

#include <iostream>
#include <numeric>
#include <vector>

int main(int argc, char** argv)
{
  if (argc != 2 || Imf::checkOpenEXRFile(argv[1])) // true: broken
  {
    std::cerr << "not a sound OpenEXR file\n";
    return 1;
  }
  Imf::DeepScanLineInputFile file(argv[1]);
  const auto window = file.header().dataWindow();
  const int width = window.max.x - window.min.x + 1;
  const int height = window.max.y - window.min.y + 1;
  const int state = Imf::hasDeepImageState(file.header())
    ? static_cast<int>(Imf::deepImageState(file.header()))
    : -1;
  std::cout << width << " " << height << " " << file.header().compression() << " " << state;
  const Imf::ChannelList& channels = file.header().channels();
  for (auto channel = channels.begin(); channel != channels.end(); ++channel)
  {
    std::cout << " " << channel.name() << ":" << channel.channel().type;
  }
  std::cout << "\n";

  const std::size_t pixels = static_cast<std::size_t>(width) * height;
  std::vector<unsigned int> counts(pixels);
  Imf::DeepFrameBuffer frame;
  frame.insertSampleCountSlice(Imf::Slice(Imf::UINT, reinterpret_cast<char*>(counts.data()),
    sizeof(unsigned int), sizeof(unsigned int) * width));
  std::vector<std::vector<float*>> pointers;
  for (auto channel = channels.begin(); channel != channels.end(); ++channel)
  {
    pointers.emplace_back(pixels);
    frame.insert(channel.name(),
      Imf::DeepSlice(Imf::FLOAT, reinterpret_cast<char*>(pointers.back().data()), sizeof(float*),
        sizeof(float*) * width, sizeof(float)));
  }
  file.setFrameBuffer(frame);
  file.readPixelSampleCounts(window.min.y, window.max.y);
  const std::size_t samples = std::accumulate(counts.begin(), counts.end(), std::size_t{ 0 });
  std::vector<std::vector<float>> values(pointers.size(), std::vector<float>(samples));
  for (std::size_t c = 0; c < pointers.size(); ++c)
  {
    float* next = values[c].data();
    for (std::size_t p = 0; p < pixels; ++p)
    {
      pointers[c][p] = next;
      next += counts[p];
    }
  }
  file.readPixels(window.min.y, window.max.y);
  std::cout.write(reinterpret_cast<const char*>(counts.data()),
    static_cast<std::streamsize>(counts.size() * sizeof(unsigned int)));
  for (const auto& channel : values)
  {
    std::cout.write(reinterpret_cast<const char*>(channel.data()),
      static_cast<std::streamsize>(channel.size() * sizeof(float)));
  }
  return std::cout.good() ? 0 : 1;
}
