#!/bin/sh
# SPDX-License-Identifier: BSD-3-Clause
# run.sh FOLDER TEST.py ...: a test with the interpreter and the tool of a virtual environment that
# install.sh has made. Without it the test is skipped (77).
folder=$1
shift
if [ ! -x "$folder/bin/surfelsplat" ]; then
  echo "SKIPPED: the wheel is not installed in $folder"
  exit 77
fi
SURFELSPLAT=$folder/bin/surfelsplat exec "$folder/bin/python" "$@"
