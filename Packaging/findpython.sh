# SPDX-License-Identifier: BSD-3-Clause
# To source: find_python 3.12 3.13 prints the first of these interpreters, on PATH or of pyenv, that
# can make virtual environments. Fails if there is none.

find_python() {
  local version candidate
  for version in "$@"; do
    for candidate in "python$version" python3 "${PYENV_ROOT:-$HOME/.pyenv}/versions/$version".*/bin/python; do
      if "$candidate" -c "import ensurepip, sys, venv; sys.exit('%d.%d' % sys.version_info[:2] != '$version')" 2>/dev/null
      then
        echo "$candidate"
        return
      fi
    done
  done
  return 1
}
