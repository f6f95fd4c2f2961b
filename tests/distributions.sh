#!/usr/bin/env bash
# The README's two commands in a bare Debian, by name of its release: tests/distributions.sh 12|13 [OPTION...]
#   --only demo|run   deploy/demo.sh --once alone, or tests/run.sh alone
#   --root DIR        the folder of the system, which must not be there yet; a temporary one without
#   --keep            leave the system there at the end
# Makes a minimal system by mmdebstrap, clones HEAD into it and runs both commands there, in namespaces of their own for
# mounts and processes. Prints the packages that each command installed, and its time. Needs root.
set -euo pipefail

fail() {
    echo "distributions: $2" >&2
    exit "$1"
}

release=
only=
root=
keep=no
while [ $# -gt 0 ]; do
    case $1 in
    --help) sed -n '2,7s/^# \?//p' "$0"; exit 0 ;;
    --only | --root) [ $# -gt 1 ] || fail 2 "$1: its value is missing" ;;&
    --only) only=$2; shift ;;
    --root) root=$2; shift ;;
    --keep) keep=yes ;;
    *) [ -z "$release" ] || fail 2 "unknown option $1; usage: tests/distributions.sh 12|13 [--only demo|run] [--root DIR] [--keep]"
       release=$1 ;;
    esac
    shift
done
case $release in
12) suite=bookworm ;;
13) suite=trixie ;;
*) fail 2 "Debian '$release' is not known: 12 (bookworm) or 13 (trixie) must be given" ;;
esac
case $only in
"" | demo | run) ;;
*) fail 2 "--only $only: demo (deploy/demo.sh) or run (tests/run.sh) must be given" ;;
esac
[ -z "$root" ] || [ ! -e "$root" ] || fail 2 "--root $root: it is there already; the system must be bare"
[ "$(id -u)" -eq 0 ] || fail 1 "only root may make a system and enter it: sudo tests/distributions.sh $release"
command -v mmdebstrap >/dev/null || fail 1 "mmdebstrap is not installed (Debian: mmdebstrap)"
cd "$(dirname "$0")/.."

holder=
[ -n "$root" ] || { holder=$(mktemp -d -t "debian-$release.XXXXXX"); root=$holder/root; }
mkdir -p "$root"
chmod 755 "$root" # apt's own user looks for its files from there
root=$(realpath "$root")
# Mounts end with the namespace of the command that made them, so that nothing but files of the system is below the root.
clean_up() {
    [ $keep = yes ] && { echo "the system stays in $root"; return; }
    rm -rf --one-file-system "$root" ${holder:+"$holder"}
}
trap clean_up EXIT
trap 'exit 130' INT TERM

# inside COMMAND: runs it in the tree of the system, as the first process of its namespace: no other outlives it. It has the
# network of this machine, with its proxy and the certificate of that, and a shared memory of its own.
variables=(PATH=/usr/local/sbin:/usr/local/bin:/usr/sbin:/usr/bin:/sbin:/bin HOME=/root TERM=dumb LANG=C.UTF-8)
for name in http_proxy https_proxy no_proxy npm_config_registry; do
    [ -z "${!name:-}" ] || variables+=("$name=${!name}")
done
inside() {
    # shellcheck disable=SC2016 # the inner shell expands them
    unshare --mount --pid --fork --kill-child bash -c '
        root=$1
        shift
        mount --make-rprivate /
        mount -t proc proc "$root/proc"
        mount --rbind /sys "$root/sys"
        mount --rbind /dev "$root/dev"
        mount -t tmpfs -o mode=1777 tmpfs "$root/dev/shm"
        mount -t tmpfs -o mode=755 tmpfs "$root/run"
        exec chroot "$root" env -i --chdir=/root/lambert "$@"' _ "$root" "${variables[@]}" "$@"
}

packages() { dpkg-query --admindir="$root/var/lib/dpkg" -W -f '${Package}\n' | sort; }

# of_readme COMMAND: runs one of the two commands, and adds to the summary what it installed and how long it took.
of_readme() {
    local before installed result=passed began=$SECONDS
    printf '\n== Debian %s: %s\n' "$release" "$*"
    before=$(packages)
    inside "$@" || result="failed (status $?)"
    installed=$(comm -13 <(echo "$before") <(packages))
    summary+=$(printf '\n%s: %s in %d s; it installed %d packages:\n' "$*" "$result" $((SECONDS - began)) "$(wc -w <<<"$installed")"
               fmt -w 110 <<<"$installed" | sed 's/^/  /')$'\n'
    [ "$result" = passed ] || { echo "$summary"; exit 1; }
}

echo "== Debian $release ($suite) in $root"
mmdebstrap --quiet --variant=minbase "$suite" "$root"
git clone --quiet --no-hardlinks . "$root/root/lambert"
[ -z "$(git status --porcelain)" ] || echo "the clone is HEAD: what is not committed is not in it"
if [ -r "${NODE_EXTRA_CA_CERTS:-}" ]; then
    cp "$NODE_EXTRA_CA_CERTS" "$root/etc/extra-certificates.pem"
    variables+=(NODE_EXTRA_CA_CERTS=/etc/extra-certificates.pem)
fi
summary="Debian $release, $(packages | wc -l) packages, made in $SECONDS s"
[ "$only" = run ] || of_readme ./deploy/demo.sh --once
[ "$only" = demo ] || of_readme ./tests/run.sh
printf '\n%s\n' "$summary"
