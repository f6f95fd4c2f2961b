#!/usr/bin/env bash
# Proves who includes whom: every quoted include against the list of its folder, every third-party header in its home;
# and that the paths of a store's groups are spelled in one header.
set -uo pipefail
cd "$(dirname "$0")/.." || exit 1
broken=0
checked=0

# Groups of folders that others name together.
below_linalg="lambert/ store/ solver/base/"
below_operator="$below_linalg solver/linalg/"
operator="$below_operator solver/operator/"
scene="$below_linalg solver/scene/"
formfactor="$operator solver/daylight/ $scene solver/formfactor/formfactor.h solver/formfactor/recipe.h solver/formfactor/factor_cost.h solver/formfactor/source.h solver/formfactor/closing.h solver/formfactor/repair.h solver/formfactor/leaving.h solver/formfactor/scratch.h solver/formfactor/sky_bounce.h"
method="$operator solver/method/"
# Headers that the methods share; folders of methods do not know each other.
method_shared="solver/method/method.h solver/method/choice.h solver/method/report.h solver/method/tall_factors.h"
method_shared+=" solver/method/norm.h solver/method/many_lights.h solver/method/reference.h"

# folder: the prefixes that its files may include beside their own folder
declare -A allowed=(
    [include/lambert]=""
    [store]="lambert/"
    [solver/base]="lambert/ store/"
    [solver/linalg]="$below_linalg"
    [solver/operator]="$below_operator solver/operator/wavelet/"
    [solver/operator/wavelet]="$below_operator"
    [solver/operator/blocks]="$below_operator"
    [solver/operator/refine]="$operator"
    [solver/operator/stated]="$operator"
    [solver/codec]="$below_linalg solver/operator/operator.h solver/operator/blocks/importance.h solver/operator/stated/"
    [solver/codec/gltf]="lambert/ store/ solver/base/ solver/codec/"
    [solver/daylight]="$below_linalg"
    [solver/scene]="$below_linalg"
    [solver/scene/facet]="$scene"
    [solver/scene/import]="$scene"
    [solver/scene/generate]="$scene"
    [solver/formfactor]="$formfactor solver/formfactor/"
    [solver/formfactor/visibility]="$formfactor"
    [solver/formfactor/rows]="$formfactor solver/formfactor/visibility/"
    [solver/formfactor/rays]="$formfactor solver/formfactor/visibility/ solver/formfactor/rows/"
    [solver/formfactor/clusters]="$formfactor solver/formfactor/visibility/"
    [solver/formfactor/exchange]="$formfactor solver/formfactor/clusters/"
    [solver/formfactor/sight]="$formfactor solver/formfactor/visibility/ solver/formfactor/clusters/ solver/formfactor/exchange/"
    [solver/formfactor/pairs]="$formfactor solver/formfactor/visibility/ solver/formfactor/rows/ solver/formfactor/rays/ solver/formfactor/clusters/ solver/formfactor/exchange/ solver/formfactor/sight/"
    [solver/formfactor/blocks]="$formfactor solver/formfactor/visibility/ solver/formfactor/exchange/ solver/formfactor/sight/"
    [solver/walk]="lambert/ store/status.h solver/base/ solver/scene/mesh.h solver/formfactor/leaving.h solver/formfactor/visibility/"
    [solver/method]="$operator"
    ["solver/method/*"]="$operator $method_shared"
    [solver/light]="$operator solver/codec/ solver/daylight/ $scene solver/formfactor/ solver/walk/moving_light.h"
    [solver/output]="$scene solver/codec/ solver/light/"
    [solver/render]="$operator $scene solver/formfactor/visibility/"
    [solver/adapt]="solver/daylight/ $method $scene solver/formfactor/"
    [solver/precompute]="solver/daylight/ $method $scene solver/formfactor/ solver/light/ solver/adapt/ solver/walk/"
    [solver/verify]="$method $scene solver/formfactor/ solver/light/ solver/precompute/ solver/walk/walk.h"
    [solver/verbs]="lambert/ store/ solver/"
    [solver]="lambert/ store/ solver/"
    [server/net]="$below_linalg solver/codec/"
    [server/queue]="$below_linalg solver/codec/"
    [server/scene]="$operator solver/codec/ server/queue/ server/config.h"
    [server/route]="$operator solver/codec/ server/net/ server/queue/ server/scene/ server/config.h"
    [server/http]="$operator solver/codec/ server/net/ server/queue/ server/scene/ server/route/ server/config.h"
    [server]="$operator solver/codec/ solver/waits.h server/"
    [tests/bench]="lambert/ store/ solver/ server/ support/ tests/bench/suites/stats.h"
    [tests/bench/suites]="$method $scene solver/formfactor/ solver/precompute/ solver/render/shade.h solver/walk/walk.h solver/walk/reuse.h solver/walk/moving_light.h solver/adapt/ solver/waits.h"
)

# third-party header: the only files or folders that may include it
declare -A home=(
    ["hdf5.h"]="store/"
    ["xxhash.h"]="store/ solver/scene/"
    ["assimp/"]="solver/scene/import/assimp_reader.c"
    ["embree3/"]="solver/formfactor/visibility/embree.h"
    ["embree4/"]="solver/formfactor/visibility/embree.h"
    ["lapacke.h"]="solver/method/ solver/linalg/core.c"
    ["cblas.h"]="solver/method/ solver/linalg/"
    ["OpenEXR/"]="solver/render/exr.c"
    ["png.h"]="solver/render/image.c solver/scene/import/image_decode.c"
    ["turbojpeg.h"]="solver/scene/import/image_decode.c solver/scene/import/picture_files.c"
    ["webp/"]="solver/scene/import/image_decode.c"
    ["jansson.h"]="solver/codec/ solver/light/light_path.c solver/scene/import/gltf_file.h solver/scene/import/gltf_cameras.c solver/verbs/ tests/bench/"
    ["microhttpd.h"]="server/http/ tests/bench/ready_server.c"
    ["zlib.h"]="server/route/content_coding.c"
    ["zstd.h"]="server/route/content_coding.c"
)

for file in $(git ls-files -co --exclude-standard 'include/*.h' 'store/*.[ch]' 'solver/*.[ch]' 'solver/*.inc' 'server/*.[ch]' 'tests/bench/*.[ch]'); do
    folder=$(dirname "$file")
    case $folder in solver/method/*) folder_rule="solver/method/*" ;; *) folder_rule=$folder ;; esac
    checked=$((checked + 1))
    if [ -z "${allowed[$folder_rule]+known}" ]; then
        echo "layers: $folder/ has no line in tests/layers.sh"
        broken=$((broken + 1))
        continue
    fi
    while read -r header; do
        [ -n "$header" ] || continue
        ok=no
        [ "$(dirname "$header")" != "$folder" ] || ok=yes
        for prefix in ${allowed[$folder_rule]}; do
            case $header in "$prefix"*) ok=yes ;; esac
        done
        if [ $ok = no ]; then
            echo "layers: $file includes \"$header\"; beside its own $folder/ may include: ${allowed[$folder_rule]}"
            broken=$((broken + 1))
        fi
    done < <(sed -n -E 's/^ *# *(include|define CPU_KERNELS) *"([^"]*)".*/\2/p' "$file")
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

# The paths of a store's groups stand in store/groups.h alone; a part of one may be called as another: STORE_ERROR "/sky".
groups=$(sed -n 's/^#define STORE_[A-Z_]* "\(\/[a-z_]*\)".*/\1/p' store/groups.h | paste -sd'|')
while read -r place; do
    echo "layers: $place: store/groups.h has this path"
    broken=$((broken + 1))
done < <(git grep --untracked -noE "(^|[^A-Z_ ]|[^A-Z_] )\"($groups)[]\"/ :,[]" -- 'solver/*.[ch]' 'server/*.[ch]' 'store/*.[ch]' ':!store/groups.h')

if [ $checked -lt 20 ]; then
    echo "layers: only $checked files found, is this the repository?"
    exit 1
fi
echo "layers: $checked files, $broken wrong includes and paths"
[ $broken -eq 0 ]
