#!/usr/bin/env bash
# From a bare Debian to the light of a scene over HTTP:
#   deploy/demo.sh [--once] [SCENE [OPTION...]]
# installs what is missing, builds, precomputes SCENE (without one: a generated Cornell box), starts lambertd on
# loopback (with its page where Node.js and npm are installed already), asks it for two lightings, draws both. --once stops
# the daemon at the end. OPTIONs go to lambert precompute; --up y for a scene whose second axis points up.
set -euo pipefail

once=no
scene=
how=()
while [ $# -gt 0 ]; do
    case $1 in
    --once) once=yes ;;
    --help) sed -n '2,6s/^# \?//p' "$0"; exit 0 ;;
    -*) echo "demo: unknown option $1; usage: deploy/demo.sh [--once] [SCENE [OPTION...]]" >&2; exit 2 ;;
    *) if [ ! -f "$1" ] || [ ! -r "$1" ]; then echo "demo: cannot read the scene $1" >&2; exit 2; fi
       scene=$(realpath -- "$1")
       shift
       how=("$@")
       break ;;
    esac
    shift
done
cd "$(dirname "$0")/.."
out=$PWD/build/demo
mkdir -p "$out"

daemon=
stop_daemon() {
    if [ -n "$daemon" ] && kill -0 "$daemon" 2>/dev/null; then
        kill -TERM "$daemon"
        wait "$daemon" || true
    fi
}
trap stop_daemon EXIT
trap 'exit 130' INT TERM

echo "== packages (minutes where many are missing)"
./deploy/install-packages

echo "== build (a minute or more the first time; log: $out/build.log)"
cmake -S . -B build/release -DCMAKE_BUILD_TYPE=Release >"$out/configure.log" || { cat "$out/configure.log"; exit 1; }
invitation="open its address in a browser, or "
grep '^-- viewer: .* not built' "$out/configure.log" && invitation=
cmake --build build/release -j "$(nproc)" --target lambert lambertd >"$out/build.log" 2>&1 ||
    { tail -n 40 "$out/build.log"; exit 1; }
lambert=$PWD/build/release/lambert
lambertd=$PWD/build/release/lambertd

if [ -z "$scene" ]; then
    echo "== scene"
    scene=$out/cornell.obj
    "$lambert" generate cornell --elements 40 -o "$scene"
fi
store=$out/$(basename "${scene%.*}").h5

echo "== precompute"
printf '%q ' lambert precompute "$scene" -o "$store" "${how[@]}"
echo
"$lambert" precompute "$scene" -o "$store" "${how[@]}"

echo "== daemon"
address=
# The usual port where it is free, else any.
for listen in 127.0.0.1:8317 127.0.0.1:0; do
    "$lambertd" "$store" --listen "$listen" >"$out/daemon.log" 2>&1 &
    daemon=$!
    while kill -0 "$daemon" 2>/dev/null; do
        address=$(sed -n 's/.*listening on \(http:[^ ]*\).*/\1/p' "$out/daemon.log" | head -n 1)
        [ -n "$address" ] && break 2
        sleep .1
    done
done
[ -n "$address" ] || { echo "demo: the daemon did not start:" >&2; cat "$out/daemon.log" >&2; exit 1; }
echo "$address/ (process $daemon)"

echo "== two lightings"
name=$(curl -sS --fail "$address/v1/scenes" | /usr/bin/python3 -c 'import json, sys; print(json.load(sys.stdin)["scenes"][0]["name"])')
path=$(/usr/bin/python3 -c 'import sys, urllib.parse; print(urllib.parse.quote(sys.argv[1], safe=""))' "$name")
url=$address/v1/scenes/$path/radiosity
/usr/bin/python3 deploy/demo_lightings.py requests "$store" "$out"
for lighting in 1 2; do
    curl -sS --fail-with-body -H 'Content-Type: application/json' --data-binary "@$out/request-$lighting.json" \
        -o "$out/answer-$lighting.json" -w 'answered in %{time_total} s\n' "$url"
    /usr/bin/python3 deploy/demo_lightings.py table "$store" "$out" "$lighting"
    picture=$out/$(basename "${store%.h5}")-$lighting.png
    "$lambert" render "$store" --emission "$out/emission-$lighting.json" --smooth -o "$picture"
    echo "picture: $picture"
    levels=${picture%.png}-levels.png
    "$lambert" render "$store" --emission "$out/emission-$lighting.json" --palette turbo --iso-lines 10 -o "$levels"
    echo "the same in false colours: $levels"
    echo
done

echo "== measured errors of this store"
"$lambert" info "$store"

echo
example="curl -H 'Content-Type: application/json' -d @$out/request-1.json $url"
if [ $once = yes ]; then
    stop_daemon
    daemon=
    echo "the daemon was stopped (--once); a request to it looks like this:"
    echo "  $example"
else
    trap - EXIT
    disown "$daemon"
    echo "the daemon goes on at $address/: ${invitation}ask it again with"
    echo "  $example"
    echo "and stop it with: kill $daemon"
fi
