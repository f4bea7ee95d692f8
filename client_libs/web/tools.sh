# Sourced by scripts. Checks the versions of Node, npm and Go, which are too old in many
# distributions.

# Returns success if version $1 is $2 or newer.
at_least() {
  printf '%s\n' "$2" "$1" | sort --check=quiet --version-sort
}

# Exits with code 77 if program $1, found in version $2, is missing ($2 empty) or older than $3.
require() {
  if [[ -z $2 ]] || ! at_least "$2" "$3"; then
    echo "the web parts need $1 $3 or newer, found ${2:-none}" >&2
    exit 77
  fi
}

# Exits with code 77, which ctest counts as skipped, if a program is missing or too old.
require_tools() {
  require Node "$(node --version 2>/dev/null | tr -d v || true)" 20.19
  require npm "$(npm --version 2>/dev/null || true)" 9
  require Go "$(go env GOVERSION 2>/dev/null | sed 's/^go//' || true)" 1.24
}
