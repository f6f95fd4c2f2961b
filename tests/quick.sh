#!/usr/bin/env bash
# The inner loop: layers, layout and comments of the tree, then the unit and contract tests of single rooms.
# usage: tests/quick.sh [ROOM...]     a folder of tests/unit; without one: the rooms whose files differ from main
set -euo pipefail
cd "$(dirname "$0")/.."

rooms=("$@")
if [ $# -eq 0 ]; then
    base=$(git merge-base main HEAD 2>/dev/null || git rev-parse HEAD)
    mapfile -t rooms < <({ git diff --name-only "$base"; git ls-files --others --exclude-standard; } |
        sed -nE 's,^(solver|tests/unit)/([a-z]+)/.*,\2,p; s,^(server|store)/.*,\1,p
                 s,^tests/(bench)/.*,\1,p; s,^(include|tests/contract|tests/support)/.*,operator,p' | sort -u)
fi
for room in "${rooms[@]}"; do
    [ -d "solver/$room" ] || [ -d "tests/unit/$room" ] ||
        { echo "quick: no room $room; rooms with unit tests: $(cd tests/unit && echo *)" >&2; exit 2; }
done
mapfile -t tested < <(for room in "${rooms[@]}"; do [ ! -d "tests/unit/$room" ] || echo "$room"; done)

./tests/layers.py
git ls-files '*.[ch]' '*.inc' | xargs -P "$(nproc)" -n 40 clang-format-19 --dry-run --Werror
./tests/comments.py

if [ ${#tested[@]} -eq 0 ]; then
    echo "quick: no room with unit tests among: ${rooms[*]:-those that differ from main} ($SECONDS s)"
    exit 0
fi
log=build/dev/quick.log
mkdir -p build/dev
{ cmake --preset dev && cmake --build build/dev -j "$(nproc)" --target "${tested[@]/#/tests_}"; } >"$log" 2>&1 ||
    { grep -E 'error|warning|undefined' "$log" || tail -n 40 "$log"; exit 1; }
OMP_WAIT_POLICY=passive ctest --test-dir build/dev -j "$(nproc)" --output-on-failure --no-tests=error \
    -L "^($(IFS='|'; echo "${tested[*]}"))\$"
echo "quick: ${tested[*]}, $SECONDS s"
