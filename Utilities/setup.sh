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

packages=(cmake ninja-build g++ libvtk9-dev libpcl-dev libopenexr-dev doctest-dev openexr python3
  libpython3-dev python3-pip python3-vtk9 python3-numpy universal-ctags xvfb xauth)

install_missing_packages() {
  local missing=() package
  for package in "${packages[@]}"; do
    if [ "$(dpkg-query -W -f='${db:Status-Status}' "$package" 2>/dev/null)" != installed ]; then
      missing+=("$package")
    fi
  done
  [ ${#missing[@]} -eq 0 ] && return
  echo "installing: ${missing[*]}"
  local as_root=()
  [ "$(id -u)" -eq 0 ] || as_root=(sudo)
  "${as_root[@]}" apt-get update -q
  "${as_root[@]}" env DEBIAN_FRONTEND=noninteractive \
    apt-get install -y -q --no-install-recommends "${missing[@]}"
}

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

if ! command -v dpkg-query >/dev/null; then
  echo "setup.sh: this is not a Debian system; install the equivalents of these packages by hand:" \
    "${packages[*]}" >&2
  exit 1
fi
install_missing_packages
configure_and_build
