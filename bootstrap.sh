#!/bin/sh
# Set up everything kerfwright needs on Debian or Ubuntu, in .venv beside this file, and run something:
#
#   sh bootstrap.sh demo     reconstruct the capture that ships, into kerfwright-demo/
#   sh bootstrap.sh test     run the tests
#   sh bootstrap.sh setup    only set up
set -eu
cd "$(dirname "$0")"
venv=.venv

say() { printf 'bootstrap: %s\n' "$*" >&2; }
die() { say "$@"; exit 1; }

# The first Python that kerfwright runs on; empty if there is none.
find_python() {
    for name in python3.11 python3.12 python3; do
        if command -v "$name" >/dev/null 2>&1 &&
            "$name" -c 'import sys; sys.exit(not (3, 11) <= sys.version_info < (3, 13))' 2>/dev/null; then
            echo "$name"
            return
        fi
    done
}

# Debian packages of the shared libraries that the wheels of OCCT and Open3D load and that are not here.
missing_packages() {
    libraries=$(PATH="$PATH:/sbin:/usr/sbin" ldconfig -p)
    for pair in libGL.so.1=libgl1 libXrender.so.1=libxrender1 libEGL.so.1=libegl1 libusb-1.0.so.0=libusb-1.0-0; do
        case "$libraries" in
            *"${pair%%=*}"*) ;;
            *) printf '%s ' "${pair#*=}" ;;
        esac
    done
    python=$(find_python)
    if [ -z "$python" ]; then
        printf 'python3 python3-venv '
    elif ! "$python" -c 'import ensurepip, venv' 2>/dev/null; then
        printf '%s-venv ' "$("$python" -c 'import sys; print("python%d.%d" % sys.version_info[:2])')"
    fi
}

install_packages() {
    packages=$(missing_packages)
    [ -n "$packages" ] || return 0
    command -v apt-get >/dev/null 2>&1 || die "not here: $packages(names of Debian packages): install them, then run this again"
    as_root=
    if [ "$(id -u)" -ne 0 ]; then
        command -v sudo >/dev/null 2>&1 || die "as root, run: apt-get install $packages; then run this again"
        as_root=sudo
    fi
    say "installing $packages"
    # shellcheck disable=SC2086  # a list of words
    { $as_root apt-get update -qq && $as_root env DEBIAN_FRONTEND=noninteractive \
        apt-get install -qq -y --no-install-recommends $packages >/dev/null; } ||
        die "apt-get failed: as root, run: apt-get install $packages; then run this again"
}

install_kerfwright() {
    if [ -f $venv/installed ] && [ -z "$(find pyproject.toml -newer $venv/installed)" ]; then return 0; fi
    python=$(find_python)
    [ -n "$python" ] || die "no Python 3.11 or 3.12 here: install one, then run this again"
    say "installing kerfwright in $venv: about two minutes and 3 GB, mostly OCCT and Open3D"
    "$python" -m venv $venv
    $venv/bin/python -m pip install --quiet --disable-pip-version-check --editable '.[test]'
    touch $venv/installed
}

case "${1:-}" in
    demo | test | setup) ;;
    *) die "usage: sh bootstrap.sh demo | test | setup" ;;
esac
install_packages
install_kerfwright
case "$1" in
    demo) shift; exec $venv/bin/kerfwright demo "$@" ;;
    test) shift; exec $venv/bin/python -m pytest "$@" ;;
esac
