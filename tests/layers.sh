#!/usr/bin/env bash
# Proves who includes whom: every quoted include against the room's list, every third-party header in its home.
set -uo pipefail
cd "$(dirname "$0")/.." || exit 1
broken=0
checked=0

# room: the prefixes its files may include
declare -A allowed=(
    [include]="lambert/"
    [store]="lambert/ store/"
    [solver/operator]="lambert/ store/ solver/operator/"
    [solver/scene]="lambert/ store/ solver/progress.h solver/scene/"
    [solver/formfactor]="lambert/ store/ solver/progress.h solver/clock.h solver/operator/ solver/matrix/row_source.h solver/scene/ solver/formfactor/"
    [solver/matrix]="lambert/ store/ solver/progress.h solver/operator/ solver/matrix/"
    [solver/build]="lambert/ store/ solver/progress.h solver/clock.h solver/operator/ solver/matrix/ solver/build/"
    [solver/bench]="lambert/ store/ solver/progress.h solver/clock.h solver/operator/ solver/scene/ solver/formfactor/ solver/matrix/ solver/build/ solver/bench/"
    [solver/daylight]="lambert/ store/ solver/progress.h solver/formfactor/sky.h solver/daylight/"
    [solver]="lambert/ store/ solver/"
    [server]="lambert/ store/ solver/operator/ server/"
    [tests/bench]="lambert/ store/ solver/ server/ tests/bench/"
)

# third-party header: the only files or folders that may include it
declare -A home=(
    ["hdf5.h"]="store/"
    ["xxhash.h"]="store/ solver/scene/"
    ["assimp/"]="solver/scene/assimp_reader.c"
    ["embree3/"]="solver/formfactor/"
    ["lapacke.h"]="solver/build/ solver/operator/core.c"
    ["cblas.h"]="solver/build/ solver/matrix/ solver/operator/core.c tests/bench/bench_online.c"
    ["cairo"]="solver/bench/plot.c"
    ["png.h"]="solver/image.c"
    ["jansson.h"]="solver/ server/ tests/bench/"
    ["microhttpd.h"]="server/http tests/bench/ready_server.c"
    ["zlib.h"]="server/codec_compress.c"
    ["zstd.h"]="server/codec_compress.c"
)

room_of() {
    case $1 in
    include/*) echo include ;;
    store/*) echo store ;;
    solver/operator/*) echo solver/operator ;;
    solver/scene/*) echo solver/scene ;;
    solver/formfactor/*) echo solver/formfactor ;;
    solver/matrix/*) echo solver/matrix ;;
    solver/daylight/*) echo solver/daylight ;;
    solver/bench/*) echo solver/bench ;;
    solver/build/*) echo solver/build ;;
    solver/*) echo solver ;;
    server/*) echo server ;;
    tests/bench/*) echo tests/bench ;;
    esac
}

for file in $(git ls-files 'include/*.h' 'store/*.[ch]' 'solver/*.[ch]' 'server/*.[ch]' 'tests/bench/*.[ch]'); do
    room=$(room_of "$file")
    checked=$((checked + 1))
    while read -r header; do
        [ -n "$header" ] || continue
        ok=no
        for prefix in ${allowed[$room]}; do
            case $header in "$prefix"*) ok=yes ;; esac
        done
        if [ $ok = no ]; then
            echo "layers: $file includes \"$header\"; $room/ may include: ${allowed[$room]}"
            broken=$((broken + 1))
        fi
    done < <(sed -n 's/^ *# *include *"\([^"]*\)".*/\1/p' "$file")
    while read -r header; do
        [ -n "$header" ] || continue
        for third in "${!home[@]}"; do
            case $header in "$third"*) ;; *) continue ;; esac
            ok=no
            for place in ${home[$third]}; do
                case $file in "$place"*) ok=yes ;; esac
            done
            if [ $ok = no ]; then
                echo "layers: $file includes <$header>, whose home is: ${home[$third]}"
                broken=$((broken + 1))
            fi
        done
    done < <(sed -n 's/^ *# *include *<\([^>]*\)>.*/\1/p' "$file")
done

if [ $checked -lt 20 ]; then
    echo "layers: only $checked files found, is this the repository?"
    exit 1
fi
echo "layers: $checked files, $broken wrong includes"
[ $broken -eq 0 ]
