# Sourced by scripts: the programs that the web parts need, which packages can't be relied on to bring.

# Whether version $1 is $2 or newer.
at_least() {
  printf '%s\n' "$2" "$1" | sort --check=quiet --version-sort
}

require() {
  if [[ -z $2 ]] || ! at_least "$2" "$3"; then
    echo "the web parts need $1 $3 or newer, here is ${2:-none}" >&2
    exit 77
  fi
}

# Ends the script with code 77, which ctest takes for skipped, when something is missing.
require_tools() {
  require Node "$(node --version 2>/dev/null | tr -d v || true)" 20.19
  require npm "$(npm --version 2>/dev/null || true)" 9
  require Go "$(go env GOVERSION 2>/dev/null | sed 's/^go//' || true)" 1.24
}
