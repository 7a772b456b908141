// SPDX-License-Identifier: BSD-3-Clause
#include "Filters/Common/AvailableMemory.h"

#include <algorithm>
#include <fstream>
#include <limits>
#include <sstream>

#ifdef __GLIBC__
#include <malloc.h>
#include <sys/resource.h>
#include <unistd.h>
#endif

namespace SurfelGeometry
{
namespace
{
constexpr double Unknown = std::numeric_limits<double>::infinity();

/// MemAvailable of /proc/meminfo: free memory and caches that can be released.
double SystemMemory()
{
  std::ifstream file("/proc/meminfo");
  std::string name, unit;
  double kibibytes = 0.0;
  while (file >> name >> kibibytes)
  {
    std::getline(file, unit);
    if (name == "MemAvailable:")
    {
      return 1024.0 * kibibytes;
    }
  }
  return Unknown;
}

double ReadNumber(const char* path)
{
  std::ifstream file(path);
  double value = 0.0;
  return file >> value ? value : Unknown; // "max" is not a number
}

/// Memory that the limit of the control group (version 2) leaves.
double GroupMemory()
{
  const double limit = ReadNumber("/sys/fs/cgroup/memory.max");
  const double used = ReadNumber("/sys/fs/cgroup/memory.current");
  return limit < Unknown && used < Unknown ? std::max(0.0, limit - used) : Unknown;
}

/// Address space that the limit of the process (ulimit -v) leaves.
double ProcessMemory()
{
#ifdef __GLIBC__
  rlimit limit;
  const double pages = ReadNumber("/proc/self/statm");
  if (getrlimit(RLIMIT_AS, &limit) == 0 && limit.rlim_cur != RLIM_INFINITY && pages < Unknown)
  {
    const double used = pages * static_cast<double>(sysconf(_SC_PAGESIZE));
    return std::max(0.0, static_cast<double>(limit.rlim_cur) - used);
  }
#endif
  return Unknown;
}
}

double AvailableMemory()
{
  return std::min({ SystemMemory(), GroupMemory(), ProcessMemory() });
}

void ReturnFreeMemory()
{
#ifdef __GLIBC__
  malloc_trim(0);
#endif
}

std::string CheckMemory(vtkIdType points, double bytesPerPoint, double available)
{
  const double needed = bytesPerPoint * static_cast<double>(points);
  if (needed <= available)
  {
    return std::string();
  }
  constexpr double gibibyte = 1024.0 * 1024.0 * 1024.0;
  std::ostringstream message;
  message.precision(3);
  message << points << " points need about " << needed / gibibyte << " GiB of memory, but only "
          << available / gibibyte << " GiB are free. Reduce the cloud to "
          << static_cast<vtkIdType>(available / bytesPerPoint) << " points, or cut it into parts.";
  return message.str();
}

std::string LackOfMemory(vtkIdType points)
{
  return "There was too little memory for " + std::to_string(points) +
    " points, here or in a process that works on the same cloud. Reduce the cloud, or cut it into "
    "parts.";
}
}
