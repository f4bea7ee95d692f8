#!/bin/bash
# A short tour of Hypermap: starts a server, draws a small office into it, asks it questions, and
# lets a robot drive through two rooms that it maps as it goes, and three explore the office.
#
#   demo/run.sh           leaves the server running and says how to ask it more
#   demo/run.sh --exit    ends the server after the tour
#   demo/run.sh --stop    ends the server of an earlier tour
#
# Everything it makes lies in build/demo, and is made anew each time. Needs the programs in
# build/bin (make build); BUILD_DIR names another build folder, DEMO_AREA another part of the
# office for the three to explore.
set -euo pipefail
cd "$(dirname "$0")/.."

build=${BUILD_DIR:-build}
demo=$build/demo
address=  # of the server
dashboard=  # its URL, when there is one
hypermap=$build/bin/hypermap

fail() {
  echo "demo: $*" >&2
  exit 1
}

# The process of an earlier tour that runs a program, if there still is one.
earlier() {
  local program=$1 pid
  [[ -f $demo/$program.pid ]] && pid=$(<"$demo/$program.pid") && [[ $pid =~ ^[0-9]+$ ]] &&
    # The kernel keeps 15 characters of the name.
    [[ $(cat "/proc/$pid/comm" 2>/dev/null) == "${program:0:15}" ]] && echo "$pid"
}

# Ends it as an operator would, and waits until it is done: a server closes its maps.
stop() {
  local program=$1 pid tries=0
  pid=$(earlier "$program") || return 0
  kill -TERM "$pid"
  while kill -0 "$pid" 2>/dev/null; do
    ((++tries <= 200)) || fail "$program (process $pid) does not end"
    sleep 0.1
  done
  rm -f "$demo/$program.pid"
}

stop_all() {
  stop hypermap-gateway
  stop hypermapd
}

# start PROGRAM HOST:PORT ARGUMENT...  Sets ready_on to where it says that it serves.
start() {
  local program=$1 listen=$2 log=$demo/$1.log tries=0 pid line
  shift 2
  # Another program may have the usual port: then the system picks a free one.
  if (exec 3<>"/dev/tcp/${listen%:*}/${listen#*:}") 2>/dev/null; then listen=127.0.0.1:0; fi
  : >"$log"
  nohup "$build/bin/$program" --listen="$listen" "$@" </dev/null >"$log" 2>&1 &
  pid=$!
  echo "$pid" >"$demo/$program.pid"
  until line=$(grep -m1 "^$program ready on " "$log"); do
    kill -0 "$pid" 2>/dev/null || fail "$program did not start: $(tail -n 1 "$log")"
    ((++tries <= 300)) || fail "$program is not ready after 30 s, see $log"
    sleep 0.1
  done
  ready_on=${line#"$program ready on "}
}

start_server() {
  start hypermapd 127.0.0.1:50051 --data_dir="$demo/maps"
  address=$ready_on
  export HYPERMAP_SERVER=$address
}

# The page for people, and the API for browsers.
start_dashboard() {
  if [[ ! -x $build/bin/hypermap-gateway ]]; then
    printf '\n(No dashboard: it is built where there are Node and Go.)\n'
    return
  fi
  start hypermap-gateway 127.0.0.1:8080 --server "$address"
  dashboard=$ready_on
  printf '\n# The dashboard is served on %s.\n' "$dashboard"
  command -v curl >/dev/null || return 0
  local call=(curl --silent
    --json '{"scope":{"map":"office","layers":["wifi"]},"point":{"x":12.2,"y":2.9}}'
    "$dashboard/hypermap.v1.QueryService/QueryPoint")
  printf '# What serves it also answers without gRPC:\n$ %s\n' "$(typed "${call[@]}")"
  "${call[@]}" --fail && echo
}

# Draws the office: layers of every kind, one of them in a frame of its own.
load_office() {
  {
    "$hypermap" map create office
    "$hypermap" transform set office dock map 20 0 1.75
    "$hypermap" layer create office floor --kind occupancy --resolution 0.05
    "$hypermap" layer create office seen --kind exploration --resolution 0.1
    "$hypermap" layer create office wifi --kind scalar --unit dBm --resolution 0.25
    "$hypermap" layer create office objects --kind semantic
    "$hypermap" layer create office dock --kind semantic --frame dock
    local layer
    for layer in floor seen wifi objects dock; do
      "$hypermap" edit office "demo/office/$layer.geojson" --layer "$layer"
    done
  } >"$demo/load.log"
}

# A command as one would type it.
typed() {
  local word line=
  for word in "$@"; do
    if [[ $word =~ ^[A-Za-z0-9_./:,=-]+$ ]]; then line+=" $word"; else line+=" '$word'"; fi
  done
  echo "${line# }"
}

# Shows a command of the build and runs it.
show() {
  printf '$ %s\n' "$(typed "$@")"
  "$build/bin/$1" "${@:2}"
}

# Says what a command asks, shows it, and runs it.
ask() {
  printf '\n# %s\n' "$1"
  shift
  printf '$ %s\n' "$(typed hypermap "$@")"
  "$hypermap" "$@"
}

tour() {
  echo
  echo "An office of about 20 x 12 m. Its east front follows the street: what stands at the loading"
  echo "dock was measured along that wall, in a frame of its own, turned by 1.75 rad."
  ask "Which layers does the map have?" layers office
  ask "What is at this point? On the kitchen table:" query point office 12.2 2.9
  ask "A point measured along the dock's wall; every layer answers, in that frame:" \
    query point office 2 0.65 --frame dock
  ask "In front of the door; outside of a layer is not the same as unknown:" \
    query point office 6.5 -2 --frame dock
  ask "What is in this area? The kitchen:" \
    query area office 10,0.2 14.5,0.2 14.5,5.1 10,5.1
  ask "Where is this value? Potted plants:" query value office 'potted plant'
  ask "Where has no robot been yet?" query value office unexplored
  ask "Where is the radio weak?" query value office '<-70' --layer wifi
  ask "Which cups are nearest to the entrance?" \
    query nearest office 0.3 6 --value cup -k 3
  ask "The same for programs:" --json query point office 12.2 2.9 --layer floor --layer seen
}

# A robot drives through two rooms that are made up here, and what it sees becomes a layer.
drive() {
  local rooms=$demo/rooms
  if [[ ! -x $build/bin/hypermap-ingest || ! -x $build/bin/render_sequence ]]; then
    printf '\n(No drive: this build has no ingest.)\n'
    return
  fi
  echo
  echo "A robot with a depth camera drives through two rooms. Its detector misses and mistakes things,"
  echo "and it knows its place to some 6 cm. (Rendered here: depth images, masks, poses, the truth.)"
  echo
  show render_sequence "$rooms" --every 2
  ask "The floor plan, as a robot would have it:" import "$rooms/occupancy.yaml" --map rooms
  printf '\n# Worker and server make objects of what was seen:\n'
  show hypermap-ingest replay "$rooms" --server "$address" --map rooms --layer objects \
    --detections detections_noisy.json --poses estimated.txt
  ask "Other words for what is there:" \
    alias rooms objects furniture=chair,couch,diningtable tv=tvmonitor
  ask "Where is furniture?" query value rooms furniture
  ask "How well does that agree with the truth?" \
    eval rooms --layer objects --truth "$rooms/gt.geojson" --png "$demo/rooms.png"
}

# Three robots find out for themselves what is in the office: nobody tells them where to go.
explore() {
  local area
  read -ra area <<<"${DEMO_AREA:-0.2,0.2 14.6,0.2 14.6,11.8 0.2,11.8}"
  local simulate=(hypermap-ingest simulate --server "$address" --map office --occupancy floor
    --objects objects,dock --area "${area[@]}" --robots 3 --seed 1)
  [[ -x $build/bin/hypermap-ingest ]] || return 0
  echo
  echo "Three robots explore the office up to the loading dock. They know its floor plan, ask the server"
  echo "where to look next, and send what their cameras show. (The world is made of the map's layers.)"
  echo
  show "${simulate[@]}" --layer found --explored explored --paths "$demo/ways.geojson"
  ask "How far did they come?" explore status office
  ask "Did they find everything? What stands there against what they found:" \
    eval office --layer found --truth demo/office/objects.geojson
  printf '\n# The same with a detector that errs, and poses as a laser gives them:\n'
  show "${simulate[@]}" --layer found_noisy --explored explored_noisy --detector noisy --pose amcl
  ask "What they found then:" \
    eval office --layer found_noisy --truth demo/office/objects.geojson
  ask "A picture of what they saw, with the ways they took:" \
    render office -o "$demo/explored.png" --layers floor,explored,found,explorations \
    --path "$demo/ways.geojson"
}

# The same question without any program of ours.
tour_with_grpcurl() {
  local grpcurl
  grpcurl=$(command -v grpcurl || command -v "$build/tools/bin/grpcurl" ||
    command -v "${HOME:-}/go/bin/grpcurl") || return 0
  local request='{"scope":{"map":"office","layers":["floor"]},"point":{"x":12.2,"y":2.9}}'
  printf '\n# Any gRPC client does, with no .proto file:\n'
  printf '$ grpcurl -plaintext %s list\n' "$address"
  "$grpcurl" -plaintext "$address" list
  printf "\$ grpcurl -plaintext -d '%s' %s hypermap.v1.QueryService/QueryPoint\n" \
    "$request" "$address"
  "$grpcurl" -plaintext -d "$request" "$address" hypermap.v1.QueryService/QueryPoint
}

say_how_to_go_on() {
  local option=
  [[ $address == 127.0.0.1:50051 ]] || option=" --server $address"
  cat <<END

The server is running on $address (process $(<"$demo/hypermapd.pid")). Ask it more:
  $hypermap$option query value office chair
  $hypermap$option query area office 14.6,0.2 19,0.2 18,6 14.6,6 --layer dock
  $hypermap$option export office --format hmap -o office.hmap
  grpcurl -plaintext -d '{"scope":{"map":"office"},"value":"cup"}' $address hypermap.v1.QueryService/QueryValue
${dashboard:+See it: $dashboard/?map=office
}What the robot saw over the truth: $demo/rooms.png
What the three explored: $demo/explored.png
The map itself is $demo/maps/office.gpkg, a GeoPackage: QGIS opens it.
Stop it:
  ${BUILD_DIR:+BUILD_DIR=$BUILD_DIR }demo/run.sh --stop
END
}

case ${1:-} in
  --stop)
    if earlier hypermapd >/dev/null; then stop_all && echo "stopped"; else echo "not running"; fi
    exit ;;
  --exit | '') ;;
  *) fail "unknown argument $1 (--exit or --stop)" ;;
esac

[[ -x $hypermap && -x $build/bin/hypermapd ]] || fail "no programs in $build/bin: make build"
stop_all
rm -rf "$demo"
mkdir -p "$demo"
trap stop_all EXIT  # until all has gone well
start_server
load_office
tour
tour_with_grpcurl
drive
explore
start_dashboard
if [[ ${1:-} == --exit ]]; then
  stop_all
  printf '\nThe programs have ended.\n'
else
  say_how_to_go_on
fi
trap - EXIT
