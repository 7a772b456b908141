// SPDX-License-Identifier: BSD-3-Clause
// For the leak sanitizer. Mesa leaks, and its driver is unloaded with its window: without this, the
// sanitizer could not tell whose these leaks are (Utilities/leaksanitizer.txt).
extern "C" int dlclose(void*)
{
  return 0;
}
