#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# Installs what is missing, configures and builds into build/. What is up to date is left alone.
#
#   bash Utilities/setup.sh              or, in a script: source it for $root, $build and $python
set -euo pipefail

root=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
build=$root/build
# Debian's interpreter, which sees python3-vtk9; a pyenv or conda python3 may come first on PATH.
python=/usr/bin/python3

packages=(cmake ninja-build g++ libvtk9-dev libpcl-dev libopenexr-dev
  doctest-dev openexr python3 libpython3-dev python3-pip python3-vtk9 python3-numpy xvfb xauth)

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

# A build folder of another source tree, or one whose configuration broke off, is of no use.
is_configured() {
  [ -f "$build/build.ninja" ] &&
    grep -qxF "CMAKE_HOME_DIRECTORY:INTERNAL=$root" "$build/CMakeCache.txt"
}

# Ray-traced scenes for the accuracy test, where they are at hand.
truth=$root/../shared/truth
[ -d "$truth" ] || truth=

# ninja itself configures anew when a CMake file has changed.
configure_and_build() {
  is_configured || cmake -S "$root" -B "$build" -G Ninja -DPython3_EXECUTABLE="$python" \
    -DSURFELSPLATTING_TRUTH_DIR="$truth"
  ninja -C "$build" -n | grep -q 'no work to do' || cmake --build "$build"
}

if ! command -v dpkg-query >/dev/null; then
  echo "setup.sh: this is not a Debian system; install the packages' counterparts by hand:" \
    "${packages[*]}" >&2
  exit 1
fi
install_missing_packages
configure_and_build
