# SPDX-License-Identifier: BSD-3-Clause
# To source: install_missing_packages PACKAGE... installs Debian packages, as root or with sudo.

install_missing_packages() {
  if ! command -v dpkg-query >/dev/null; then
    echo "$(basename "$0"): this is not a Debian system; install the equivalents of these packages" \
      "by hand: $*" >&2
    return 1
  fi
  local missing=() package
  for package in "$@"; do
    if [ "$(dpkg-query -W -f='${db:Status-Status}' "$package" 2>/dev/null)" != installed ]; then
      missing+=("$package")
    fi
  done
  [ ${#missing[@]} -eq 0 ] && return
  echo "installing: ${missing[*]}"
  local as_root=()
  [ "$(id -u)" -eq 0 ] || as_root=(sudo)
  "${as_root[@]}" apt-get update -q
  "${as_root[@]}" env DEBIAN_FRONTEND=noninteractive \
    apt-get install -y -q --no-install-recommends "${missing[@]}"
}
