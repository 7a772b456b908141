#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# Writes a manual page of surfelsplat and one of each of its commands from what --help all prints.
# Needs help2man.
# Usage: manpages.sh SURFELSPLAT FOLDER COMMAND...
set -euo pipefail

tool=$1 folder=$2
shift 2
version=$("$tool" --version | cut -d ' ' -f 2)
mkdir -p "$folder"
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT

# page NAME DESCRIPTION ALSO WORDS...: the page of `surfelsplat WORDS...`
page() {
  local name=$1 description=$2 also=$3
  shift 3
  # argparse begins with "usage:", help2man looks for "Usage:", and for a paragraph for each example.
  cat >"$work/$name" <<END
#!/bin/sh
"$tool" $* --help all | awk '
  { sub(/^usage:/, "Usage:") }
  /^  surfelsplat / && previous !~ /^examples:/ { print "" }
  { print; previous = \$0 }'
END
  chmod +x "$work/$name"
  printf '[see also]\n%s\n' "$also" >"$work/$name.also"
  COLUMNS=80 help2man --no-info --version-string="$name $version" --name="$description" \
    --include="$work/$name.also" --output="$folder/$name.1" "$work/$name"
}

pages=()
for command in "$@"; do
  # The first line of the summary in the list of commands.
  description=$(COLUMNS=200 "$tool" --help | sed -n "s/^ *$command  *//p" | head -n 1)
  page "surfelsplat-$command" "$description" ".BR surfelsplat (1)" "$command"
  pages+=(".BR surfelsplat-$command (1)")
done
page surfelsplat "depth-of-field splatting of point clouds" "$(printf '%s\n' "${pages[@]}")"
