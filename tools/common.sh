# SPDX-License-Identifier: Apache-2.0
# shellcheck shell=bash
# Shared by tools/setup, tools/test, tools/demo and tools/fluxtrue: sourced, never run.

tools_dir=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd -P) || exit 1
root=$(dirname "$tools_dir")
build="$root/build"
venv_python="$build/venv/bin/python"
export PYTHONPATH="$tools_dir" PYTHONDONTWRITEBYTECODE=1
# A user's own Python packages and start-up hooks must not reach into the pinned environment.
export PYTHONNOUSERSITE=1
unset PYTHONHOME PYTHONSTARTUP

say() { printf '%s\n' "$*" >&2; }

fail() {
    say "error: $*"
    exit 2
}

# Only one set-up or build at a time in a checkout. The lock is inherited by the scripts we start.
lock_build() {
    [ "${FLUXTRUE_LOCK:-}" = "$build" ] && return
    mkdir -p "$build" 2>/dev/null || fail "cannot create $build"
    [ -w "$build" ] || fail "cannot write to $build"
    command -v flock >/dev/null || fail "flock is missing (Debian package util-linux)"
    exec 9>>"$build/.lock" || fail "cannot write to $build/.lock"
    if ! flock -n 9; then
        say "waiting for another tools/ command in this checkout to finish"
        flock 9
    fi
    export FLUXTRUE_LOCK="$build"
}

unlock_build() {
    unset FLUXTRUE_LOCK
    exec 9>&-
}

# The stamp of the Python environment: the pinned list it was made from.
venv_stamp() { sha256sum <"$tools_dir/requirements.txt"; }

venv_ready() {
    [ -x "$venv_python" ] && [ "$(cat "$build/venv/stamp" 2>/dev/null)" = "$(venv_stamp)" ]
}

# Configures build/<preset>. A folder that was copied with its checkout is configured anew.
configure() { # preset [cmake arguments]
    local preset="$1" home fresh=()
    shift
    home=$(sed -n 's/^CMAKE_HOME_DIRECTORY:INTERNAL=//p' "$build/$preset/CMakeCache.txt" 2>/dev/null) || true
    [ "$home" = "$root" ] || fresh=(--fresh)
    (cd "$root" && cmake --preset "$preset" "${fresh[@]}" "$@")
}

# The libraries the command line loads: build/host, without the tests.
build_libraries() {
    local log="$build/build.log"
    say "building the simulation (log: $log)"
    if ! { configure host && cmake --build "$build/host" -j 2 --target fluxtrue_libraries; } \
        >"$log" 2>&1; then
        tail -n 20 "$log" >&2
        fail "the build failed (see $log)"
    fi
}
