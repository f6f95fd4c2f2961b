#!/usr/bin/env bash
# Fuzzes every parser of bytes from outside, by libFuzzer under AddressSanitizer and UndefinedBehaviourSanitizer.
# usage: tests/fuzz/run.sh [SECONDS [NAME ...]]     seconds for each (60); json adjoint npy store import index head image gltf
#        weather skies luminaire luminaire_reply placed sensors
# What it finds is left in build/fuzz/found/NAME: give it a name and put it into tests/fuzz/found/NAME, where the
# tests replay it for ever.
set -euo pipefail
cd "$(dirname "$0")/../.."
seconds=${1:-60}
shift || true
names=("$@")
if [ ${#names[@]} -eq 0 ]; then
    for file in tests/fuzz/fuzz_*.c; do
        name=$(basename "$file" .c)
        names+=("${name#fuzz_}")
    done
fi
build=build/fuzz
cmake --preset fuzz >/dev/null
cmake --build "$build" -j "$(nproc)" --target lambert "${names[@]/#/fuzz_}" >/dev/null
/usr/bin/python3 tests/fuzz/make_seeds.py "$PWD/$build/lambert" "$build/seeds"
export ASAN_OPTIONS=detect_leaks=1 LSAN_OPTIONS=suppressions=$PWD/tests/support/lsan.supp:print_suppressions=0
failed=0
for name in "${names[@]}"; do
    printf '== %s, %s s\n' "$name" "$seconds"
    mkdir -p "$build/corpus/$name" "$build/found/$name" "tests/fuzz/found/$name"
    longest=65536
    memory=4096
    # The headers of a store are read in a child, which under a sanitizer starts more slowly beside other threads.
    [ "$name" = store ] && longest=1048576 memory=0
    [ "$name" = store ] && export OMP_NUM_THREADS=1
    "$build/tests/fuzz_$name" -max_total_time="$seconds" -max_len=$longest -timeout=20 -rss_limit_mb=$memory \
        -artifact_prefix="$build/found/$name/" -print_final_stats=1 "$build/corpus/$name" "$build/seeds/$name" \
        "tests/fuzz/found/$name" >"$build/$name.log" 2>&1 || failed=1
    grep -E 'stat::(number_of_executed_units|average_exec_per_sec)|ERROR|SUMMARY|Test unit' "$build/$name.log" || true
done
rmdir --ignore-fail-on-non-empty tests/fuzz/found/* tests/fuzz/found
exit $failed
