// SPDX-License-Identifier: BSD-3-Clause
// DumpEXR FILE: the file's window, compression and channels as one line of text, then the channels'
// values as raw 32-bit floats, one channel after the other, top row first. Fails where OpenEXR
// finds the file broken.
#include <OpenEXR/ImfChannelList.h>
#include <OpenEXR/ImfCheckFile.h>
#include <OpenEXR/ImfFrameBuffer.h>
#include <OpenEXR/ImfHeader.h>
#include <OpenEXR/ImfInputFile.h>

#include <iostream>
#include <vector>

int main(int argc, char** argv)
{
  if (argc != 2 || Imf::checkOpenEXRFile(argv[1])) // true: broken
  {
    std::cerr << "not a sound OpenEXR file\n";
    return 1;
  }
  Imf::InputFile file(argv[1]);
  const auto window = file.header().dataWindow();
  const int width = window.max.x - window.min.x + 1;
  const int height = window.max.y - window.min.y + 1;
  std::cout << width << " " << height << " " << file.header().compression();
  std::vector<std::vector<float>> planes;
  const Imf::ChannelList& channels = file.header().channels();
  for (auto channel = channels.begin(); channel != channels.end(); ++channel)
  {
    std::cout << " " << channel.name() << ":" << channel.channel().type;
    planes.emplace_back(static_cast<std::size_t>(width) * height);
  }
  std::cout << "\n";

  Imf::FrameBuffer frame;
  auto plane = planes.begin();
  for (auto channel = channels.begin(); channel != channels.end(); ++channel, ++plane)
  {
    frame.insert(channel.name(),
      Imf::Slice::Make(Imf::FLOAT, plane->data(), window, sizeof(float), sizeof(float) * width));
  }
  file.setFrameBuffer(frame);
  file.readPixels(window.min.y, window.max.y);
  for (const auto& values : planes)
  {
    std::cout.write(reinterpret_cast<const char*>(values.data()),
      static_cast<std::streamsize>(values.size() * sizeof(float)));
  }
  return std::cout.good() ? 0 : 1;
}
