#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# install.sh 3.12 FOLDER: a new virtual environment FOLDER with the wheel in dist/ and what it requires.
# Without that interpreter the test is skipped (77).
set -euo pipefail
version=$1 folder=$2
root=$(cd "$(dirname "${BASH_SOURCE[0]}")/../.." && pwd)

source "$root/Packaging/findpython.sh"
python=$(find_python "$version") || {
  echo "SKIPPED: there is no Python $version with the module venv on PATH or of pyenv"
  exit 77
}
rm -rf "$folder"
"$python" -m venv "$folder"
"$folder/bin/pip" install -q --no-compile --disable-pip-version-check "$root"/dist/surfelsplatting-*.whl
"$folder/bin/pip" check
