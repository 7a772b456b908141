#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# Renders demo.png with depth of field: the built-in scene, or your own point cloud.
#
#   bash Examples/demo.sh [CLOUD]
set -euo pipefail
cloud=${1:+$(realpath -m -- "$1")}
if [ -n "$cloud" ] && [ ! -f "$cloud" ]; then
  echo "demo.sh: $1 does not exist" >&2
  exit 2
fi

# The messages of the set-up go to stderr; stdout has only the one line at the end.
source "$(dirname "${BASH_SOURCE[0]}")/../Utilities/setup.sh" >&2

picture=$root/demo.png
if [ -n "$cloud" ]; then
  what="${cloud##*/}, in focus where the middle of the picture shows it"
  options=(--size 1280 800 --circle-of-confusion 60)
else
  cloud=$build/demo/scene.ply
  what="toadstools in a meadow at dusk"
  mkdir -p "$build/demo"
  if [ ! -f "$cloud" ] || [ -n "$(find "$root"/Examples/demo_*.py -newer "$cloud")" ]; then
    "$python" -s "$root/Examples/demo_scene.py" "$cloud" "$build/demo/camera.json"
  fi
  options=(--camera "$build/demo/camera.json" --unlit)
fi
"$build/bin/surfelsplat" render "$cloud" "${options[@]}" -o "$picture" --stats "$build/demo.json"

"$python" -s - "$build/demo.json" "$what" "$picture" <<'PYTHON'
import json
import sys

stats, what, picture = json.load(open(sys.argv[1])), sys.argv[2], sys.argv[3]
print(f"{picture}: {what}, {stats['points']:,} points, {stats['size'][0]} x {stats['size'][1]}, "
      f"frame in {stats['milliseconds']['frame'] / 1000:.1f} s on {stats['threads']} cores")
PYTHON
