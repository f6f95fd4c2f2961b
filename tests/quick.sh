#!/usr/bin/env bash
# The inner loop: the layers of the tree, layout and comments of the files that differ from main, then the unit and contract
# tests of single rooms with fewer cases (LAMBERT_QUICK in tests/CMakeLists.txt), each file in one process.
# usage: tests/quick.sh [ROOM...]     a folder of tests/unit, or all; without one: the rooms whose files differ from main
set -euo pipefail
cd "$(dirname "$0")/.."

base=$(git merge-base main HEAD 2>/dev/null || git rev-parse HEAD)
mapfile -t changed < <({ git diff --name-only --diff-filter=d "$base"; git ls-files --others --exclude-standard; } | sort -u)
rooms=("$@")
if [ $# -eq 0 ]; then
    mapfile -t rooms < <({ git diff --name-only "$base"; git ls-files --others --exclude-standard; } |
        sed -nE 's,^(solver|tests/unit)/([a-z]+)/.*,\2,p; s,^(server|store)/.*,\1,p
                 s,^tests/(bench)/.*,\1,p; s,^(include|tests/contract|tests/support)/.*,operator,p' | sort -u)
elif [ "$*" = all ]; then
    mapfile -t rooms < <(ls tests/unit)
fi
for room in "${rooms[@]}"; do
    [ -d "solver/$room" ] || [ -d "tests/unit/$room" ] ||
        { echo "quick: no room $room; rooms with unit tests: $(cd tests/unit && echo *)" >&2; exit 2; }
done
mapfile -t tested < <(for room in "${rooms[@]}"; do [ ! -d "tests/unit/$room" ] || echo "$room"; done)

./tests/layers.py
if [ ${#changed[@]} -gt 0 ]; then
    printf '%s\n' "${changed[@]}" | { grep -E '\.(c|h|inc)$' || true; } |
        xargs -r -P "$(nproc)" -n 40 clang-format-19 --dry-run --Werror
    ./tests/comments.py "${changed[@]}"
fi

if [ ${#tested[@]} -eq 0 ]; then
    echo "quick: no room with unit tests among: ${rooms[*]:-those that differ from main} ($SECONDS s)"
    exit 0
fi
log=build/quick/quick.log
mkdir -p build/quick
{
    [ build/quick/CMakeCache.txt -nt CMakePresets.json ] || cmake --preset quick -G Ninja
    cmake --build build/quick -j "$(nproc)" --target "${tested[@]/#/tests_}"
} >"$log" 2>&1 || { grep -E 'error|warning|undefined' "$log" || tail -n 40 "$log"; exit 1; }
CK_FORK=no OMP_WAIT_POLICY=passive ctest --test-dir build/quick -j "$(nproc)" --output-on-failure --no-tests=error \
    -L "^($(IFS='|'; echo "${tested[*]}"))\$"
echo "quick: ${tested[*]}, $SECONDS s"
