#!/bin/bash
# A short tour of Hypermap: starts a server, creates the map of a small office, queries it, maps two
# rooms from a simulated drive of a robot, and lets three simulated robots explore the office.
#
#   demo/run.sh           runs the tour, leaves the server running and prints further commands
#   demo/run.sh --exit    runs the tour and stops the server
#   demo/run.sh --stop    stops the server of an earlier tour
#   demo/run.sh --brief   starts with the dashboard, asks less, and lets robots explore the west of the
#                         office only; may be combined with --exit
#
# `hypermap demo` runs it from the Debian packages, with --brief.
#
# All output is in build/demo, which each tour replaces. The tour needs the programs in build/bin
# (make build). BUILD_DIR names another build folder, DEMO_AREA another part of the office for the
# three robots to explore. DEMO_BIN names another folder of programs, and DEMO_DIR another folder for output.
set -euo pipefail
cd "$(dirname "$0")/.."

build=${BUILD_DIR:-build}
bin=${DEMO_BIN:-$build/bin}
demo=${DEMO_DIR:-$build/demo}
brief=
address=    # HOST:PORT of the server
dashboard=  # URL of the dashboard; empty if it is not running
hypermap=$bin/hypermap

fail() {
  echo "demo: $*" >&2
  exit 1
}

# Prints the process id of a program that an earlier tour started. Fails if it is not running.
earlier() {
  local program=$1 pid
  [[ -f $demo/$program.pid ]] && pid=$(<"$demo/$program.pid") && [[ $pid =~ ^[0-9]+$ ]] &&
    # The kernel truncates the name to 15 characters.
    [[ $(cat "/proc/$pid/comm" 2>/dev/null) == "${program:0:15}" ]] && echo "$pid"
}

# Stops a program with SIGTERM and waits until it has ended, because a server closes its maps first.
stop() {
  local program=$1 pid tries=0
  pid=$(earlier "$program") || return 0
  kill -TERM "$pid"
  while kill -0 "$pid" 2>/dev/null; do
    ((++tries <= 200)) || fail "$program (process $pid) does not stop"
    sleep 0.1
  done
  rm -f "$demo/$program.pid"
}

stop_all() {
  stop hypermap-gateway
  stop hypermapd
}

# start PROGRAM HOST:PORT ARGUMENT...  Starts a program and sets ready_on to its address or URL.
start() {
  local program=$1 listen=$2 log=$demo/$1.log tries=0 pid line
  shift 2
  # If another program uses the port, the system chooses a free one.
  if (exec 3<>"/dev/tcp/${listen%:*}/${listen#*:}") 2>/dev/null; then listen=127.0.0.1:0; fi
  : >"$log"
  # In a session of its own, so that the niceness of the server's long work does not count against
  # other programs (decision 25).
  setsid nohup "$bin/$program" --listen="$listen" "$@" </dev/null >"$log" 2>&1 &
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

# Starts the gateway, which serves the dashboard and the API for browsers.
start_dashboard() {
  if [[ ! -x $bin/hypermap-gateway ]]; then
    printf '\n(Skipped the dashboard: no hypermap-gateway in %s. Building it requires Node and Go.)\n' "$bin"
    return
  fi
  start hypermap-gateway 127.0.0.1:8080 --server "$address"
  dashboard=$ready_on
  printf '\n# The dashboard is served on %s.\n' "$dashboard"
  command -v curl >/dev/null || return 0
  local call=(curl --silent
    --json '{"scope":{"map":"office","layers":["wifi"]},"point":{"x":12.2,"y":2.9}}'
    "$dashboard/hypermap.v1.QueryService/QueryPoint")
  printf '# The gateway also answers requests in JSON:\n$ %s\n' "$(typed "${call[@]}")"
  "${call[@]}" --fail && echo
}

# Creates the map of the office with layers of every kind, one of them in its own frame.
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

# Prints a command as it would be typed in a shell.
typed() {
  local word line=
  for word in "$@"; do
    if [[ $word =~ ^[A-Za-z0-9_./:,=-]+$ ]]; then line+=" $word"; else line+=" '$word'"; fi
  done
  echo "${line# }"
}

# Prints a command and runs its program in build/bin.
show() {
  printf '$ %s\n' "$(typed "$@")"
  "$bin/$1" "${@:2}"
}

# Prints a description and a command of hypermap, and runs the command.
ask() {
  printf '\n# %s\n' "$1"
  shift
  printf '$ %s\n' "$(typed hypermap "$@")"
  "$hypermap" "$@"
}

brief_tour() {
  ask "What is on the kitchen table?" query point office 12.2 2.9
  ask "Which cups are nearest to the entrance?" \
    query nearest office 0.3 6 --value cup -k 3
}

tour() {
  echo
  echo "The map shows an office of about 20 x 12 m. Its east wall follows a slanted street. Objects"
  echo "at the loading dock were measured along that wall, in the frame dock, rotated by 1.75 rad."
  ask "Which layers does the map have?" layers office
  ask "What is on the kitchen table?" query point office 12.2 2.9
  ask "Query a point in the frame of the dock; all layers answer in that frame:" \
    query point office 2 0.65 --frame dock
  ask "Query a point in front of the door; it is outside of the grids, not unknown:" \
    query point office 6.5 -2 --frame dock
  ask "What is in the kitchen?" \
    query area office 10,0.2 14.5,0.2 14.5,5.1 10,5.1
  ask "Where are potted plants?" query value office 'potted plant'
  ask "Which areas are unexplored?" query value office unexplored
  ask "Where is the Wi-Fi signal weak?" query value office '<-70' --layer wifi
  ask "Which cups are nearest to the entrance?" \
    query nearest office 0.3 6 --value cup -k 3
  ask "Print an answer as JSON:" --json query point office 12.2 2.9 --layer floor --layer seen
}

# Renders the drive of a robot through two rooms, and makes a layer of its observations.
drive() {
  local rooms=$demo/rooms
  if [[ ! -x $bin/hypermap-ingest || ! -x $bin/render_sequence ]]; then
    printf '\n(Skipped the simulated drive: this build has no ingest worker.)\n'
    return
  fi
  echo
  echo "A robot with a depth camera drives through two rooms. Its detector misses and misclassifies"
  echo "objects, and its position error is about 6 cm. The recording (depth images, masks, poses)"
  echo "and its ground truth are rendered here."
  echo
  show render_sequence "$rooms" --every 2
  ask "Import the floor plan of the rooms:" import "$rooms/occupancy.yaml" --map rooms
  printf '\n# The ingest worker and the server turn the camera frames into objects:\n'
  show hypermap-ingest replay "$rooms" --server "$address" --map rooms --layer objects \
    --detections detections_noisy.json --poses estimated.txt
  ask "Define aliases for labels:" \
    alias rooms objects furniture=chair,couch,diningtable tv=tvmonitor
  ask "Query an alias:" query value rooms furniture
  ask "Compare the objects with ground truth:" \
    eval rooms --layer objects --truth "$rooms/gt.geojson" --png "$demo/rooms.png"
}

# Three simulated robots explore the office. The server chooses their goals.
explore() {
  local area
  local east=14.6
  [[ -z $brief ]] || east=5
  read -ra area <<<"${DEMO_AREA:-0.2,0.2 $east,0.2 $east,11.8 0.2,11.8}"
  local simulate=(hypermap-ingest simulate --server "$address" --map office --occupancy floor
    --objects objects,dock --area "${area[@]}" --robots 3 --seed 1)
  [[ -x $bin/hypermap-ingest ]] || return 0
  echo
  echo "Three simulated robots explore the office up to the loading dock. They know its floor plan,"
  echo "get their goals from the server, and send observations of their cameras. The simulated"
  echo "world is made of the layers of the map."
  echo
  show "${simulate[@]}" --layer found --explored explored --paths "$demo/ways.geojson"
  ask "Show the progress of the exploration:" explore status office
  ask "Compare the objects that they found with the true ones:" \
    eval office --layer found --truth demo/office/objects.geojson
  [[ -z $brief ]] || return 0
  printf '\n# Explore again, with detection errors and the pose errors of laser localization:\n'
  show "${simulate[@]}" --layer found_noisy --explored explored_noisy --detector noisy --pose amcl
  ask "Compare the objects again:" \
    eval office --layer found_noisy --truth demo/office/objects.geojson
  ask "Draw the explored floor, the objects and the paths of the robots:" \
    render office -o "$demo/explored.png" --layers floor,explored,found,explorations \
    --path "$demo/ways.geojson"
}

# Sends the same query with grpcurl, if it is installed.
tour_with_grpcurl() {
  local grpcurl
  grpcurl=$(command -v grpcurl || command -v "$build/tools/bin/grpcurl" ||
    command -v "${HOME:-}/go/bin/grpcurl") || return 0
  local request='{"scope":{"map":"office","layers":["floor"]},"point":{"x":12.2,"y":2.9}}'
  printf '\n# Any gRPC client can send queries, without .proto files:\n'
  printf '$ grpcurl -plaintext %s list\n' "$address"
  "$grpcurl" -plaintext "$address" list
  printf "\$ grpcurl -plaintext -d '%s' %s hypermap.v1.QueryService/QueryPoint\n" \
    "$request" "$address"
  "$grpcurl" -plaintext -d "$request" "$address" hypermap.v1.QueryService/QueryPoint
}

print_next_steps() {
  local option=
  [[ $address == 127.0.0.1:50051 ]] || option=" --server $address"
  if [[ -n $brief ]]; then
    cat <<END

The server is running on $address (process $(<"$demo/hypermapd.pid")). More commands:
  hypermap$option query value office chair
  hypermap$option layers office
${dashboard:+Dashboard: $dashboard/?map=office
}The map is stored in $demo/maps/office.gpkg, a GeoPackage, which QGIS can open.
To stop the programs:
  hypermap demo --stop
END
    return
  fi
  cat <<END

The server is running on $address (process $(<"$demo/hypermapd.pid")). More commands:
  $hypermap$option query value office chair
  $hypermap$option query area office 14.6,0.2 19,0.2 18,6 14.6,6 --layer dock
  $hypermap$option export office --format hmap -o office.hmap
  grpcurl -plaintext -d '{"scope":{"map":"office"},"value":"cup"}' $address hypermap.v1.QueryService/QueryValue
${dashboard:+Dashboard: $dashboard/?map=office
}Objects of the robot, drawn over the ground truth: $demo/rooms.png
Exploration by the three robots: $demo/explored.png
The map is stored in $demo/maps/office.gpkg, a GeoPackage, which QGIS can open.
To stop the programs:
  ${BUILD_DIR:+BUILD_DIR=$BUILD_DIR }demo/run.sh --stop
END
}

leave=
for argument; do
  case $argument in
    --stop)
      if earlier hypermapd >/dev/null; then stop_all && echo "stopped"; else echo "not running"; fi
      exit ;;
    --exit) leave=1 ;;
    --brief) brief=1 ;;
    *) fail "unknown argument $argument; usage: demo/run.sh [--brief] [--exit | --stop]" ;;
  esac
done

[[ -x $hypermap && -x $bin/hypermapd ]] ||
  fail "no programs in $bin; run 'make build' or 'apt install hypermap-server' first"
# $DEMO_DIR may be a folder of something else by mistake.
[[ ! -e $demo || -e $demo/hypermapd.log ]] || rmdir "$demo" 2>/dev/null ||
  fail "$demo is no folder of an earlier demo: remove it first"
stop_all
rm -rf "$demo"
mkdir -p "$demo"
trap stop_all EXIT  # Stops the programs if a step fails.
start_server
load_office
if [[ -n $brief ]]; then
  brief_tour
  start_dashboard
  explore
else
  tour
  tour_with_grpcurl
  drive
  explore
  start_dashboard
fi
if [[ -n $leave ]]; then
  stop_all
  printf '\nThe programs have been stopped.\n'
else
  print_next_steps
fi
trap - EXIT
