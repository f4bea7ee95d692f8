#!/bin/bash
# Builds the node of ros2-client in build/ros2 of the project, and prints the path of the program.
#
# The exit code is 77 if this machine has no suitable Rust, or can't get the crates of Cargo.lock.
set -euo pipefail
cd "$(dirname "$0")"
target=$(realpath -m ../../../build/ros2/peer)

skip() {
  echo "skipped: $*" >&2
  exit 77
}

rust=$(rustc --version 2>/dev/null | cut -d' ' -f2 || true)
if [[ -z $rust ]] || ! printf '%s\n' 1.88 "$rust" | sort --check=quiet --version-sort; then
  skip "tests/ros2/peer needs Rust 1.88 or newer, found ${rust:-none}"
fi
host=$(rustc --version --verbose | sed -n 's/^host: //p')
cargo fetch --quiet --locked --target "$host" || skip "no registry of crates"
cargo build --quiet --release --locked --target-dir "$target"
echo "$target/release/hypermap_ros2_peer"
