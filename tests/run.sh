#!/usr/bin/env bash
# All tests: layers and layout, then all but a few tests under AddressSanitizer and UndefinedBehaviorSanitizer, the
# daemon's tests under ThreadSanitizer and beside them a warning-free build by the other compiler and clang-tidy, with the
# tests that try fewer cases under sanitizers, and those few (AS_USERS in tests/CMakeLists.txt) with programs as users build
# them. The builds are the presets of CMakePresets.json, in build/.
# usage: tests/run.sh [--all]          --all: all unit and contract tests by the other compiler too, two minutes more
#        tests/run.sh --since REVISION  all that is built, and of the tests those that the files that differ from a revision can
#                                       reach by the graph of each build (tests/reach.py); a change of fixtures, of CMake or of a
#                                       file that nothing is known of reaches all. Before a merge and a tag all are run.
set -euo pipefail
cd "$(dirname "$0")/.."
by_clang=optimised
since=
case "$#:$*" in
0:) ;;
1:--all) by_clang='unit|contract|optimised' ;;
2:"--since "*) since=$(git rev-parse --verify "$2^{commit}") ;;
*)
    echo "tests/run.sh: '$*': nothing, --all or --since REVISION must be given" >&2
    exit 2
    ;;
esac
jobs=$(nproc)
logs=build/logs
mkdir -p "$logs"

./deploy/install-packages deploy/packages tests/packages

step() { printf '\n== %s (%d s)\n' "$*" "$SECONDS"; }

# configure PRESET OPTIONS...: users build by make, and tests by Ninja, which takes no seconds to look at 500 targets. A
# folder that is there keeps its own.
configure() {
    local preset=$1 generator=()
    shift
    [ "$preset" = release ] || [ -e "build/$preset/CMakeCache.txt" ] || generator=(-G Ninja)
    cmake --preset "$preset" "${generator[@]}" "$@" >"$logs/$preset.configure" 2>&1 ||
        { cat "$logs/$preset.configure"; exit 1; }
}

# build PRESET TARGETS...: builds a preset that is configured; without targets, all of it.
build() {
    local preset=$1
    shift
    cmake --build --preset "$preset" -j "$jobs" ${@:+--target "$@"} >"$logs/$preset.build" 2>&1 ||
        { tail -n 60 "$logs/$preset.build"; exit 1; }
}

total_passed=0
total_failed=0
# tally PRESET: adds what its log of ctest says to the totals; finding no test is a failure, but where a change reaches none.
tally() {
    local preset=$1 passed failed
    passed=$(grep -cE '^ *[0-9]+/[0-9]+ Test .* Passed ' "$logs/$preset.ctest" || true)
    failed=$(grep -cE '^ *[0-9]+/[0-9]+ Test .*(Failed|Timeout|Not Run|Exception|\*\*\*)' "$logs/$preset.ctest" || true)
    [ $((passed + failed)) -gt 0 ] || [ -n "$since" ] || failed=1
    total_passed=$((total_passed + passed))
    total_failed=$((total_failed + failed))
}

# tests_of PRESET REGEX CTEST-ARGUMENTS...: runs the tests of that name, or those of them that the change reaches, and prints what
# failed, into the log that tally reads.
tests_of() {
    local preset=$1 names=$2 none=error
    shift 2
    [ -z "$since" ] || { names=$(./tests/reach.py "build/$preset" "$since" "$names"); none=ignore; }
    ctest --test-dir "build/$preset" --output-on-failure --no-tests=$none -R "$names" "$@" | tee "$logs/$preset.ctest" || true
}

# run_ctest PRESET REGEX CTEST-ARGUMENTS...: both, one after the other.
run_ctest() {
    tests_of "$@"
    tally "$1"
}

# clang_build: all of the tree by clang, where a warning is an error, and clang-tidy.
clang_build() {
    configure clang
    build clang
    { if [ -n "$since" ]; then ./tests/reach.py --sources "$since"; else git ls-files 'solver/*.c' 'server/*.c' 'store/*.c' 'tests/bench/suites/*.c'; fi; } |
        xargs -r -P "$jobs" -n 8 clang-tidy --quiet -p build/clang >"$logs/tidy" 2>/dev/null || { cat "$logs/tidy"; return 1; }
}

step "layers, layout and comments"
./tests/layers.py
git ls-files '*.[ch]' '*.inc' | xargs -P "$jobs" -n 40 clang-format-19 --dry-run --Werror
./tests/comments.py

# Threads that wait should not spin while two of them share a core with a server and its clients. Both programs see to that by themselves; unit
# tests are other programs, whose OpenMP does what the environment says.
export OMP_WAIT_POLICY=passive

step "programs as users have them, by which tests make references, and which the demonstration finds built"
configure release -DCMAKE_COMPILE_WARNING_AS_ERROR=ON -DLAMBERT_VIEWER=ON
build release lambert lambertd lambert-bench lambert_shared lambert_static
export LAMBERT_REFERENCE=$PWD/build/release/lambert

step "all tests under AddressSanitizer and UndefinedBehaviorSanitizer"
configure asan
build asan
# Only leaks that pass through our code count; the interpreter and the graphics libraries keep their own.
# Freed memory waits in 16 MB instead of 256: every open of a store forks, and copies the tables of all pages.
export ASAN_OPTIONS=detect_leaks=1:quarantine_size_mb=16 LSAN_OPTIONS=suppressions=$PWD/tests/support/lsan.supp:print_suppressions=0
export UBSAN_OPTIONS=print_stacktrace=1
# A process for each check would have its leaks looked for each time: half of the time of the contract. One test more than
# cores: those of slow clients and of time limits mostly wait.
CK_FORK=no run_ctest asan . -j $((jobs + 1))

step "the daemon under ThreadSanitizer, which mostly waits; beside it clang: a warning-free build, clang-tidy, tests that compute"
configure tsan -DLAMBERT_TEST_PROGRAM="$LAMBERT_REFERENCE"
build tsan lambertd tests_server
configure users
build users ready_server faults
mkdir -p build/release/tests
ln -sf "$PWD/build/users/tests/ready_server" build/release/tests/ # where `lambert bench service` looks for it
# Clients of a daemon have limits of time; a build and tests that only compute have none. Clang's tests run in one process
# each: a child that ends without handlers of exit leaves a registration of clang's OpenMP in /dev/shm, and a later process
# of its number crashes by it.
waiting='^(server|store|scene)$' # rooms with threads and children whose time is limited
rm -f "$logs/clang.ctest"
(
    renice -n 19 "$BASHPID"
    failed=0
    clang_build || failed=1
    CK_FORK=no tests_of clang . -L "$by_clang" -LE "$waiting" -j "$jobs"
    exit "$failed"
) >"$logs/clang" 2>&1 &
clang=$!
export TSAN_OPTIONS=suppressions=$PWD/tests/support/tsan.supp:halt_on_error=1:exitcode=66
# The daemon shares its passes among threads of its own; OpenMP's runtime, which the unit tests' operators use, is not
# instrumented: its barriers would look like races.
export CK_FORK=no OPENBLAS_NUM_THREADS=1 OMP_NUM_THREADS=1
run_ctest tsan 'service\.(daemon|refusals|reduce|guard|headers|io_thread|fair|leaving|request_memory)|unit\.(batch|kept_forms|turns|request_memory|thread_budget|adjoint_rows|guard_parts|lingering)' \
    -j $((jobs + 1))
unset CK_FORK OPENBLAS_NUM_THREADS OMP_NUM_THREADS

wait "$clang" || total_failed=$((total_failed + 1))
cat "$logs/clang"

step "tests by clang of rooms whose children and threads have limits of time"
if [ -e "$logs/clang.ctest" ]; then # it is built
    tally clang
    CK_FORK=no run_ctest clang . -L "$by_clang" -L "$waiting" -j "$jobs"
fi

step "programs as users have them: faults, kills, an installation, the commands of all documents, the bench"
run_ctest users . -j $((jobs + 1)) -L as_users

step "totals"
echo "$total_passed passed, $total_failed failed"
[ "$total_failed" -eq 0 ]
