#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# Installs missing packages, configures, and builds into build/. Skips what is up to date.
#
#   bash Utilities/setup.sh              A script can source it to get $root, $build and $python.
set -euo pipefail

root=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
build=$root/build
# Debian's interpreter has python3-vtk9; a pyenv or conda python3 may come first on PATH.
python=/usr/bin/python3

source "$root/Utilities/packages.sh"
packages=(cmake ninja-build g++ libvtk9-dev libpcl-dev libopenexr-dev libzstd-dev doctest-dev openexr
  python3 libpython3-dev python3-pip python3-vtk9 python3-numpy python3-pil universal-ctags xvfb
  xauth xdotool chromium ffmpeg help2man man-db python3-argcomplete)

# False for the build folder of another source tree and for one whose configuration failed.
is_configured() {
  [ -f "$build/build.ninja" ] &&
    grep -qxF "CMAKE_HOME_DIRECTORY:INTERNAL=$root" "$build/CMakeCache.txt"
}

# Ray-traced scenes for the accuracy test, if they are available.
truth=$root/../shared/truth
[ -d "$truth" ] || truth=

# ninja runs CMake again when a CMake file has changed.
configure_and_build() {
  is_configured || cmake -S "$root" -B "$build" -G Ninja -DPython3_EXECUTABLE="$python" \
    -DSURFELSPLATTING_TRUTH_DIR="$truth"
  ninja -C "$build" -n | grep -q 'no work to do' || cmake --build "$build"
}

install_missing_packages "${packages[@]}"
configure_and_build
