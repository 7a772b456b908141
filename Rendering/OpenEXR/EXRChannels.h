// SPDX-License-Identifier: BSD-3-Clause
/**
 * Names of channels in OpenEXR files and of the arrays that they become. Internal to the module.
 */
#pragma once

#include <array>
#include <string>

namespace SurfelSplatting
{
/// The channels of a deep file, in the order of the components of the array DeepSamples. The last
/// one is missing where no sample has an extent.
constexpr int LeastDeepChannels = 5, MostDeepChannels = 6;
constexpr std::array<const char*, MostDeepChannels> DeepChannels{ "R", "G", "B", "A", "Z",
  "ZBack" };

struct NamedChannel
{
  const char* Array;
  const char* Channel; ///< three components become Channel.X, Channel.Y and Channel.Z
};

/// All others have the same name in both.
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
