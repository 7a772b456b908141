#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# Sets up, builds and runs every test. Arguments go to ctest: bash Testing/test.sh -L commandline
set -euo pipefail
source "$(dirname "${BASH_SOURCE[0]}")/../Utilities/setup.sh"

screen=()
if [ -z "${DISPLAY:-}" ]; then
  # The tests of the render pass open windows.
  screen=(xvfb-run -a -s "-screen 0 1280x1024x24 -noreset")
fi
# Four at a time, also on two processors: many wait for servers, windows, browsers, disks and downloads.
status=0
"${screen[@]}" ctest --test-dir "$build" -j 4 --output-on-failure --no-tests=error \
  --output-junit "$build/Testing/junit.xml" "$@" || status=$?
grep -h "^SKIPPED" "$build/Testing/Temporary/LastTest.log" || true
exit $status
