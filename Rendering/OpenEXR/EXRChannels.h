// SPDX-License-Identifier: BSD-3-Clause
/**
 * What a picture's point arrays are called as channels of OpenEXR files. Internal to the module.
 */
#pragma once

#include <string>

namespace SurfelSplatting
{
struct NamedChannel
{
  const char* Array;
  const char* Channel; ///< of three components: Channel.X, Channel.Y and Channel.Z
};

/// All others are called the same in both.
constexpr NamedChannel NamedChannels[] = { { "Depth", "Z" }, { "Normal", "N" },
  { "CircleOfConfusion", "CoC" }, { "Coverage", "coverage" }, { "Fragments", "fragments" },
  { "Level", "level" } };

inline std::string ChannelOfArray(const std::string& array)
{
  for (const NamedChannel& named : NamedChannels)
  {
    if (array == named.Array)
    {
      return named.Channel;
    }
  }
  return array;
}

inline std::string ArrayOfChannel(const std::string& channel)
{
  for (const NamedChannel& named : NamedChannels)
  {
    if (channel == named.Channel)
    {
      return named.Array;
    }
  }
  return channel;
}
}
