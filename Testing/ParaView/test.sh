#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# Builds the ParaView plugin and runs its tests, in a separate Debian: python3-paraview cannot be
# installed together with python3-vtk9, which everything else needs. It is kept between runs.
#
#   bash Testing/ParaView/test.sh [--release 12|13|bookworm|trixie] [--core PREFIX] [FOLDER]   as root
#
# The release is by default the one this machine runs, 13 on other systems; FOLDER is build/paraview.
# The plugin links the core and the filters' code for points that this machine has installed in PREFIX if the
# releases are the same.
# Real scans come from ../shared/scans beside the checkout. If the project is built in build/, their
# pictures are compared with plain VTK's. Exit status 77: skipped, with a reason.
set -euo pipefail

root=$(cd "$(dirname "${BASH_SOURCE[0]}")/../.." && pwd)
machine=$(. /etc/os-release && echo "${VERSION_CODENAME:-}")
release=$machine core=
[ "$release" = bookworm ] || release=trixie
while [[ ${1:-} == --* ]]; do
  case $1 in
    --release) release=${2:-} ;;
    --core) core=${2:-} ;;
    *)
      echo "test.sh: unknown option $1" >&2
      exit 2
      ;;
  esac
  shift $(($# > 1 ? 2 : 1))
done
case $release in
  12 | bookworm) release=bookworm ;;
  13 | trixie) release=trixie ;;
  *)
    echo "test.sh: --release $release: must be 12, 13, bookworm or trixie" >&2
    exit 2
    ;;
esac
[ "$release" = "$machine" ] || core=
folder=${1:-$root/build/paraview}/$release
debian=$folder/debian
scans=$root/../shared/scans
package=$root/build/lib/python3/dist-packages
packages=(python3-paraview mpi-default-bin xvfb xauth libgl1-mesa-dri g++ cmake
  ninja-build libboost-dev libflann-dev libeigen3-dev libx11-dev libxcursor-dev
  libgl-dev libopengl-dev libpng-dev zlib1g-dev libopenmpi-dev libfreetype-dev libglew-dev
  python3-dev python3-numpy)
# Without -noreset the server ends between windows now and then.
screen=(-s "-screen 0 1280x1024x24 -noreset")

skip() {
  echo "SKIPPED, the ParaView plugin is not tested: $1" >&2
  exit 77
}

inside() {
  chroot "$debian" env -u DISPLAY HOME=/root DEBIAN_FRONTEND=noninteractive "$@"
}

find_mmdebstrap() {
  command -v mmdebstrap >/dev/null && return
  (apt-get update -q && apt-get install -y -q --no-install-recommends mmdebstrap) \
    >"$folder/mmdebstrap.log" 2>&1 || skip "mmdebstrap cannot be installed"
}

# Without py3compile packages leave out the compilation of all their Python modules: those that are
# used are compiled on first use. dpkg does not wait for the disk after each file. It is told both inside:
# mmdebstrap would start a filter for each package that it unpacks. An empty package stands for those of
# ParaView's plots and web servers, which come with 90 others. Two packages are unpacked
# without what they depend on: libpcl-dev depends on the VTK that python3-paraview conflicts with, and only
# its headers are used; paraview-dev on Qt's tools, of 240 MB.
make_debian() {
  [ "$(cat "$debian/complete" 2>/dev/null)" = "${packages[*]}" ] && return
  find_mmdebstrap
  rm -rf "$debian"
  mmdebstrap --mode=root --variant=apt --include="${packages[*]}" \
    --extract-hook='printf "path-exclude=/usr/bin/py3compile\nforce-unsafe-io\n" >"$1/etc/dpkg/dpkg.cfg.d/quick"' \
    --essential-hook='chroot "$1" sh -ec "
      mkdir -p /tmp/unused/DEBIAN && cd /tmp/unused
      printf \"Package: unused\nVersion: 1\nArchitecture: all\nMaintainer: nobody\nDescription: empty\n\" >DEBIAN/control
      echo Provides: python3-matplotlib, python3-twisted, python3-autobahn >>DEBIAN/control
      dpkg-deb -b . ../unused.deb && dpkg -i ../unused.deb"' \
    --customize-hook='chroot "$1" sh -ec "
      cd /tmp && apt-get download -q libpcl-dev paraview-dev
      dpkg -x libpcl-dev_*.deb /opt/pcl && dpkg -x paraview-dev_*.deb /"' \
    "$release" "$debian" http://deb.debian.org/debian >"$folder/packages.log" 2>&1 ||
    skip "packages could not be installed, see $folder/packages.log"
  echo "${packages[*]}" >"$debian/complete"
}

# The sources are copied: mounts would outlive a run that is cut short. Unchanged files keep
# their time and are not built again.
copy_sources() {
  rm -rf "$debian/source" "$debian/core" "$debian/scans" "$debian/results"
  mkdir -p "$debian/source" "$debian/build" "$debian/scans" "$debian/results"
  # Without its source nothing but the installed core can be compiled against.
  (cd "$root" && tar -cf - CMakeLists.txt $([ "$core" ] || echo Core) Examples/ParaView Filters \
    Parallel Plugins Rendering SurfelData Testing/Benchmarks/measures.py Testing/ParaView \
    Testing/Shared Utilities) | tar -xf - -C "$debian/source"
  [ -z "$core" ] || cp -a "$core" "$debian/core"
  if [ -d "$scans" ]; then
    cp "$scans"/*.pcd "$scans"/*.ply "$debian/scans"
  else
    echo "SKIPPED, no real scans are drawn: there is no $scans" >&2
  fi
}

# Each process of ParaView's looks up the machine's name, and would wait for a name server.
name_machine() {
  echo "127.0.0.1 localhost $(hostname)" >"$debian/etc/hosts"
}

build_plugin() {
  inside cmake -S /source -B /build -G Ninja -DSURFELSPLATTING_BUILD_PARAVIEW_PLUGIN=ON \
    -DPCL_ROOT=/opt/pcl/usr -DSURFELSPLATTING_CORE_PREFIX="${core:+/core}" \
    >"$folder/configure.log" 2>&1 || { cat "$folder/configure.log" && exit 1; }
  inside cmake --build /build
}

# All run, also after one that has failed, in one display. Many wait for servers, ranks and windows: three
# processes at a time, in folders of their own.
run_tests() {
  local plugin
  plugin=$(inside find /build -name SurfelSplatting.so)
  inside env PLUGIN="$plugin" EXAMPLES=/source/Examples/ParaView \
    SCANS="$([ -d "$scans" ] && echo /scans)" OPENBLAS_NUM_THREADS=1 \
    PYTHONPATH=/source/Testing/ParaView:/source/Testing/Benchmarks:/source/Testing/Shared \
    xvfb-run -n 170 -a "${screen[@]}" bash -c '
      cd /source/Testing/ParaView
      run_tests() { # FOLDER TEST...
        # Two processes that make the folder of Open MPI at once fail.
        export FOLDER=$1 TMPDIR=$(mktemp -d)
        mkdir -p "$FOLDER"
        pvpython runtests.py "${@:2}"
      }
      status=0
      run_tests /results/alone TestProcesses >/results/processes.log 2>&1 &
      processes=$!
      run_tests /results/views TestSurfelSplats TestStates >/results/views.log 2>&1 &
      views=$!
      shopt -s extglob
      others=(Test!(Processes|SurfelSplats|States).py)
      (run_tests /results "${others[@]%.py}") || status=1
      wait $views || status=1
      wait $processes || status=1
      cat /results/views.log /results/processes.log
      exit $status'
}

compare_with_plain_vtk() {
  [ -d "$scans" ] || return 0
  if [ ! -d "$package/surfelsplatting" ]; then
    echo "SKIPPED, not compared with plain VTK: the project is not built in $root/build" >&2
    return
  fi
  PYTHONPATH=$package:$root/Testing/Benchmarks xvfb-run -a "${screen[@]}" /usr/bin/python3 \
    "$root/Testing/ParaView/plainvtk.py" "$scans" "$debian"/results/scans/*.{ply,pcd}.png
}

[ "$(id -u)" -eq 0 ] || skip "chroot needs root"
mkdir -p "$folder"
make_debian
copy_sources
name_machine
build_plugin
run_tests
compare_with_plain_vtk
