#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# Builds the ParaView plugin and runs its tests, in a Debian of its own: python3-paraview and
# python3-vtk9, which all else needs, exclude each other. It is kept between runs.
#
#   bash Testing/ParaView/test.sh [FOLDER]    default: build/paraview; as root
#
# Exit status 77: skipped, and why.
set -euo pipefail

root=$(cd "$(dirname "${BASH_SOURCE[0]}")/../.." && pwd)
folder=${1:-$root/build/paraview}
debian=$folder/debian
packages=(paraview-dev python3-paraview mpi-default-bin xvfb xauth libgl1-mesa-dri g++ cmake
  ninja-build libflann-dev libeigen3-dev libx11-dev libxcursor-dev libgl-dev libopengl-dev libpng-dev
  zlib1g-dev libopenmpi-dev libfreetype-dev libglew-dev python3-dev python3-numpy)

skip() {
  echo "SKIPPED, the ParaView plugin is not tested: $1" >&2
  exit 77
}

inside() {
  chroot "$debian" env -u DISPLAY HOME=/root DEBIAN_FRONTEND=noninteractive "$@"
}

make_debian() {
  [ -e "$debian/complete" ] && return
  command -v debootstrap >/dev/null || skip "debootstrap is not installed"
  rm -rf "$debian"
  mkdir -p "$debian"
  debootstrap --variant=minbase bookworm "$debian" http://deb.debian.org/debian \
    >"$folder/debootstrap.log" 2>&1 || skip "debootstrap failed, see $folder/debootstrap.log"
  cp /etc/resolv.conf "$debian/etc/resolv.conf"
  (inside apt-get update -q && inside apt-get install -y -q --no-install-recommends \
    "${packages[@]}") >"$folder/packages.log" 2>&1 ||
    skip "packages could not be installed, see $folder/packages.log"
  touch "$debian/complete"
}

# The sources are copied: mounts would outlive a run that is cut short.
copy_sources() {
  rm -rf "$debian/source"
  mkdir -p "$debian/source" "$debian/build"
  (cd "$root" && tar -cf - CMakeLists.txt Filters Parallel Plugins Rendering Testing/ParaView Utilities) |
    tar -xf - -C "$debian/source"
}

[ "$(id -u)" -eq 0 ] || skip "chroot needs root"
mkdir -p "$folder"
make_debian
copy_sources
inside cmake -S /source -B /build -G Ninja -DSURFELSPLATTING_BUILD_PARAVIEW_PLUGIN=ON \
  >"$folder/configure.log" 2>&1 || { cat "$folder/configure.log" && exit 1; }
inside cmake --build /build
plugin=$(inside find /build -name SurfelSplatting.so)
for test in "$root"/Testing/ParaView/Test*.py; do
  echo "== $(basename "$test")"
  # Without -noreset the server ends between windows now and then.
  inside env PLUGIN="$plugin" FOLDER=/tmp xvfb-run -n 170 -a -s "-screen 0 1024x768x24 -noreset" \
    pvpython "/source/Testing/ParaView/$(basename "$test")"
done
