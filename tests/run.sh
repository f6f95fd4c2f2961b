#!/usr/bin/env bash
# All tests: layers and layout, then every test under AddressSanitizer and UndefinedBehaviourSanitizer, then the
# daemon's tests against a ThreadSanitizer build and with faults around it, then a warning-free build by the other
# compiler.
# usage: tests/run.sh [BUILD-FOLDER]
set -euo pipefail
cd "$(dirname "$0")/.."
builds=${1:-build}
jobs=$(nproc)
logs=$builds/logs
mkdir -p "$logs"

./deploy/install-packages

step() { printf '\n== %s (%d s)\n' "$*" "$SECONDS"; }

# configure_and_build NAME TARGETS... -- CMAKE-ARGUMENTS...
configure_and_build() {
    local name=$1 targets=()
    shift
    while [ "$1" != -- ]; do
        targets+=("$1")
        shift
    done
    shift
    cmake -S . -B "$builds/$name" -DCMAKE_BUILD_TYPE=RelWithDebInfo "$@" >"$logs/$name.configure" 2>&1 ||
        { cat "$logs/$name.configure"; exit 1; }
    cmake --build "$builds/$name" -j "$jobs" ${targets[@]:+--target "${targets[@]}"} >"$logs/$name.build" 2>&1 ||
        { tail -n 60 "$logs/$name.build"; exit 1; }
}

total_passed=0
total_failed=0
# run_ctest NAME CTEST-ARGUMENTS...: prints what failed, adds to the totals; finding no test is a failure.
run_ctest() {
    local name=$1 passed failed
    shift
    ctest --test-dir "$builds/$name" --output-on-failure --no-tests=error "$@" | tee "$logs/$name.ctest" || true
    passed=$(grep -cE '^ *[0-9]+/[0-9]+ Test .* Passed ' "$logs/$name.ctest" || true)
    failed=$(grep -cE '^ *[0-9]+/[0-9]+ Test .*(Failed|Timeout|Not Run|Exception|\*\*\*)' "$logs/$name.ctest" || true)
    [ $((passed + failed)) -gt 0 ] || failed=1
    total_passed=$((total_passed + passed))
    total_failed=$((total_failed + failed))
}

step "layers and layout"
./tests/layers.sh
git ls-files '*.[ch]' '*.inc' | xargs clang-format --dry-run --Werror

# Threads that wait should not spin while two of them share a core with a server and its clients.
export OMP_WAIT_POLICY=passive

step "all tests under AddressSanitizer and UndefinedBehaviourSanitizer"
configure_and_build asan -- -DLAMBERT_SANITIZE=address,undefined
# Only leaks that pass through our code count; the interpreter and the graphics libraries keep their own.
export ASAN_OPTIONS=detect_leaks=1 LSAN_OPTIONS=suppressions=$PWD/tests/support/lsan.supp:print_suppressions=0
export UBSAN_OPTIONS=print_stacktrace=1
run_ctest asan -j "$jobs"

step "the daemon under ThreadSanitizer"
configure_and_build tsan lambertd unit_batch unit_adjoint_rows unit_guard_parts -- -DLAMBERT_SANITIZE=thread
configure_and_build release lambert lambertd faults -- -DCMAKE_BUILD_TYPE=Release
export TSAN_OPTIONS=suppressions=$PWD/tests/support/tsan.supp:halt_on_error=1:exitcode=66
# OpenMP's runtime is not instrumented: its barriers would look like races, so a pass has one thread here; for the
# daemon alone, as NumPy's BLAS waits for ever under such a limit.
export CK_FORK=no OPENBLAS_NUM_THREADS=1 OMP_NUM_THREADS=1 LAMBERTD_OMP_THREAD_LIMIT=1
cmake -S . -B "$builds/tsan" -DLAMBERT_TEST_PROGRAM="$PWD/$builds/release/lambert" >/dev/null
run_ctest tsan -j "$jobs" -R 'service\.(daemon|reduce|guard|headers)|unit\.(batch|adjoint_rows|guard_parts)'
unset CK_FORK OPENBLAS_NUM_THREADS OMP_NUM_THREADS LAMBERTD_OMP_THREAD_LIMIT

step "a daemon to which memory, clocks and kill -9 happen"
run_ctest release -R 'service\.faults'

step "a warning-free build by clang, and the unit and contract tests of it"
configure_and_build clang -- -DCMAKE_C_COMPILER=clang -DCMAKE_BUILD_TYPE=Release
run_ctest clang -L 'unit|contract' -j "$jobs"

step "totals"
echo "$total_passed passed, $total_failed failed"
[ "$total_failed" -eq 0 ]
