#!/bin/bash
# Tries the Debian packages in a fresh Debian 12: installs them, runs the demo, upgrades, removes and purges
# them. Prints one line for each check, and the seconds that installation and demo took.
#
#   tests/packaging/run.sh [PACKAGES]    the folder of the packages, default build/packages
#
# OLD_PACKAGES is a folder with the packages of the last release, which the upgrade starts from; without it, the
# packages are rebuilt with a lower version. MIRROR is a Debian mirror. The exit code is 77 if a root can't be
# made here: mmdebstrap or debootstrap is missing, the user has no right to, or no mirror can be reached.
#
# The root has no systemd running: units are checked by systemd-analyze verify, and the server is started by hand
# as its user.
set -euo pipefail
cd "$(dirname "$0")/../.."
packages=$(realpath "${1:-build/packages}")
mirror=${MIRROR:-http://deb.debian.org/debian}
work=$(mktemp -d "${TMPDIR:-/tmp}/hypermap-packages.XXXXXX")
root=$work/root
checks=0

skip() {
  echo "skipped: $*" >&2
  exit 77
}

fail() {
  echo "FAILED: $*" >&2
  exit 1
}

# check WHAT COMMAND...: the command must succeed; its output is shown if it fails.
check() {
  local what=$1 output
  shift
  output=$("$@" 2>&1) || fail "$what: $* → $output"
  checks=$((checks + 1))
  echo "ok: $what"
}

# refuse WHAT COMMAND...: the command must fail.
refuse() {
  local what=$1
  shift
  if "$@" >/dev/null 2>&1; then fail "$what: $*"; fi
  checks=$((checks + 1))
  echo "ok: $what"
}

# Runs a command in the root, in a known environment. The demo needs a home.
enter=(chroot "$root" /usr/bin/env -i HOME=/root PATH=/usr/sbin:/usr/bin:/sbin:/bin LC_ALL=C.UTF-8
       DEBIAN_FRONTEND=noninteractive)
inside() { "${enter[@]}" "$@"; }

cleanup() {
  # Ends what was left running in the root: only processes whose root it is.
  local link
  for link in /proc/[0-9]*/root; do
    [[ $(readlink "$link" 2>/dev/null) == "$root" ]] || continue
    kill -KILL "$(basename "$(dirname "$link")")" 2>/dev/null || true
  done
  local folder
  for folder in proc dev; do
    mountpoint -q "$root/$folder" 2>/dev/null && umount -l "$root/$folder"
  done
  rm -rf --one-file-system "$work"
}

make_root() {
  ((EUID == 0)) || skip "only root can make and enter a root (unshare --map-root-user may do, too)"
  if command -v mmdebstrap >/dev/null; then
    mmdebstrap --quiet --variant=apt bookworm "$root" "$mirror" >"$work/root.log" 2>&1 ||
      skip "mmdebstrap: $(tail -n 1 "$work/root.log")"
  elif command -v debootstrap >/dev/null; then
    debootstrap --variant=minbase bookworm "$root" "$mirror" >"$work/root.log" 2>&1 ||
      skip "debootstrap: $(tail -n 1 "$work/root.log")"
  else
    skip "neither mmdebstrap nor debootstrap is here (apt install mmdebstrap)"
  fi
  mount --bind /proc "$root/proc" || skip "no right to mount"
  mount --rbind /dev "$root/dev"
  # No service is started, as in a container.
  printf '#!/bin/sh\nexit 101\n' >"$root/usr/sbin/policy-rc.d"
  chmod +x "$root/usr/sbin/policy-rc.d"
  cp /etc/resolv.conf "$root/etc/resolv.conf"
}

# Packages like those in PACKAGES, but of an older version, in $work/old.
make_old_packages() {
  mkdir -p "$work/old"
  if [[ -n ${OLD_PACKAGES:-} ]]; then
    cp "$OLD_PACKAGES"/hypermap-*.deb "$work/old"
    return
  fi
  local package name
  for package in "$packages"/hypermap-*.deb; do
    name=$(basename "${package%%_*}")
    dpkg-deb --raw-extract "$package" "$work/unpacked"
    sed -i 's/^Version: .*/Version: 0.0.1/' "$work/unpacked/DEBIAN/control"
    dpkg-deb --root-owner-group -Znone --build "$work/unpacked" "$work/old/${name}_0.0.1.deb" >/dev/null
    rm -rf "$work/unpacked"
  done
}

# install_from FOLDER
install_from() {
  rm -rf "$root/packages"
  mkdir "$root/packages"
  cp "$1"/hypermap-*.deb "$root/packages"
  # shellcheck disable=SC2016 # The shell in the root expands the pattern.
  inside sh -c 'apt-get install --yes --quiet --no-install-recommends --allow-downgrades \
    -o Dpkg::Options::=--force-confold /packages/*.deb' >"$work/apt.log" 2>&1 ||
    fail "apt-get install: $(tail -n 20 "$work/apt.log")"
}

# start_server: starts the server as its unit does, and waits until it is ready.
start_server() {
  # Not by inside, which would be a shell in the background: $! is the server's process.
  "${enter[@]}" setpriv --reuid=hypermap --regid=hypermap --init-groups \
    hypermapd --config=/etc/hypermap/hypermapd.yaml >"$work/server.out" 2>"$work/server.log" </dev/null &
  server=$!
  local tries=0
  until grep -q '^hypermapd ready on ' "$work/server.out"; do
    kill -0 "$server" 2>/dev/null || fail "hypermapd: $(<"$work/server.log")"
    ((++tries <= 300)) || fail "hypermapd is not ready after 30 s"
    sleep 0.1
  done
}

# chroot and setpriv replace themselves by the server, so that $server is its process.
stop_server() {
  kill -TERM "$server"
  wait "$server" || fail "hypermapd ended with $?: $(<"$work/server.log")"
}

compgen -G "$packages/hypermap-server_*.deb" >/dev/null || fail "no packages in $packages: make package"
trap cleanup EXIT
make_root
make_old_packages
inside apt-get update --quiet >"$work/apt.log" 2>&1 || skip "apt-get update: $(tail -n 1 "$work/apt.log")"

# An older version, with a map and a changed configuration.
began=$SECONDS
install_from "$work/old"
installed_s=$((SECONDS - began))
refuse "no compiler was installed" inside sh -c 'command -v gcc || command -v clang'
check "the user exists" inside getent passwd hypermap
check "the maps belong to the server" \
  test "$(inside stat --format='%U %G %a' /var/lib/hypermap)" = "hypermap hypermap 750"
check "the configuration is for root and the server" \
  test "$(inside stat --format='%U %G %a' /etc/hypermap)" = "root hypermap 2750"
check "the configuration is valid" inside hypermapd --config=/etc/hypermap/hypermapd.yaml --check_config
for page in man1/hypermap.1 man8/hypermapd.8 man8/hypermap-ros2.8; do
  check "there is $page" test -s "$root/usr/share/man/$page"
done
check "bash completes" inside bash -c \
  'source /usr/share/bash-completion/completions/hypermap
   COMP_WORDS=(hypermap map cre); COMP_CWORD=2; _hypermap; [[ ${COMPREPLY[*]} == create ]]'
echo 'log_level: debug' >>"$root/etc/hypermap/hypermapd.yaml"
start_server
check "a map is created" inside hypermap map create kept
stop_server

# The upgrade keeps the map and the configuration.
install_from "$packages"
version=$(dpkg-deb --field "$(compgen -G "$packages/hypermap-server_*.deb" | head -n 1)" Version)
check "the new version is installed" \
  test "$(inside dpkg-query --showformat='${Version}' --show hypermap-server)" = "$version"
check "programs tell the version of their packages" \
  test "$(inside hypermapd --version) $(inside hypermap --version)" = "hypermapd $version hypermap $version"
check "the upgrade keeps the changed configuration" grep -q '^log_level: debug' "$root/etc/hypermap/hypermapd.yaml"
start_server
check "the upgrade keeps maps" inside sh -c 'hypermap maps | grep -q kept'
stop_server

check "a token that root makes can be read by the server" inside sh -c \
  'hypermap token create anna --role editor >/dev/null &&
   setpriv --reuid=hypermap --regid=hypermap --init-groups cat /etc/hypermap/access.yaml >/dev/null'

start_server
timeout --signal=TERM 5 "${enter[@]}" hypermap-ros2 --map=kept --localhost >"$work/ros2.out" 2>&1 || true
check "hypermap-ros2 shows a map" grep -q '^hypermap-ros2 ready on domain 0$' "$work/ros2.out"
stop_server

began=$SECONDS
check "the demo runs" inside hypermap demo
demo_s=$((SECONDS - began))
check "the demo's server answers" inside sh -c 'hypermap query value office chair | grep -q chair'
check "the demo stops" inside hypermap demo --stop
echo "installed in $installed_s s, demo in $demo_s s"
check "installation and demo took less than two minutes" test $((installed_s + demo_s)) -lt 120

if [[ -x $root/usr/bin/systemd-analyze ]] || inside apt-get install --yes --quiet systemd >"$work/apt.log" 2>&1; then
  check "the units are valid" inside systemd-analyze verify --man=no \
    /usr/lib/systemd/system/hypermapd.service /usr/lib/systemd/system/hypermap-gateway.service \
    /usr/lib/systemd/system/hypermap-ros2@.service
  for unit in hypermapd hypermap-gateway hypermap-ros2@; do
    check "$unit.service is exposed at most 2.0" inside systemd-analyze security --offline=true --threshold=20 \
      "/usr/lib/systemd/system/$unit.service"
  done
fi

# Purge keeps maps unless asked.
names=$(inside dpkg-query --showformat='${Package} ' --show 'hypermap-*')
# shellcheck disable=SC2086 # Several names.
check "the packages are purged" inside apt-get purge --yes --quiet $names
check "purge keeps maps" test -s "$root/var/lib/hypermap/kept.gpkg"
refuse "purge removes the configuration" test -e "$root/etc/hypermap/hypermapd.yaml"
refuse "purge removes the programs" test -e "$root/usr/bin/hypermapd"
install_from "$packages"
check "installed again, the server has its maps" \
  test "$(inside stat --format=%U /var/lib/hypermap/kept.gpkg)" = hypermap
check "purge deletes maps when asked" inside env HYPERMAP_PURGE_DATA=yes apt-get purge --yes --quiet hypermap-server
refuse "the maps are deleted" test -e "$root/var/lib/hypermap"
install_from "$packages"
check "debconf is told to delete maps" inside sh -c \
  'echo hypermap-server hypermap-server/purge_data boolean true | debconf-set-selections'
check "purge asks debconf" inside apt-get purge --yes --quiet hypermap-server
refuse "the maps are deleted as debconf says" test -e "$root/var/lib/hypermap"

echo "$checks checks passed"
