#!/bin/sh
# SPDX-License-Identifier: BSD-3-Clause
# Runs a test that needs a window: in the display there is, if it answers, in a virtual one
# otherwise. Without either the test is skipped (77), not passed.
if [ -n "$DISPLAY" ] && { ! command -v xdpyinfo >/dev/null 2>&1 || xdpyinfo >/dev/null 2>&1; }; then
  exec "$@"
fi
if command -v xvfb-run >/dev/null 2>&1; then
  exec xvfb-run -a -s "-screen 0 1280x1024x24 -noreset" "$@"
fi
echo "no display that answers and no xvfb-run: skipped"
exit 77
