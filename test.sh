#!/usr/bin/env bash
# Runs all tests. On a Debian or Ubuntu machine without any Vulkan driver it first installs Mesa's software one, because
# the GPU path is tested everywhere. Where that is impossible, PACKSTONE_ALLOW_NO_GPU=1 lets the GPU tests pass untested.
set -euo pipefail
cd "$(dirname "$0")"

# Mesa complains on stderr where a session has no runtime directory.
export XDG_RUNTIME_DIR="${XDG_RUNTIME_DIR:-$(mktemp -d)}"
cargo build --release

if [ "${PACKSTONE_ALLOW_NO_GPU:-}" != 1 ] && ! cargo run --release --quiet -- adapters && command -v apt-get >/dev/null; then
    echo "no GPU adapter found: installing Mesa's software Vulkan driver"
    sudo=""
    if [ "$(id -u)" != 0 ]; then
        if ! command -v sudo >/dev/null; then
            echo "cannot install it: you are not root and there is no sudo. Either run, as root," >&2
            echo "    apt-get install --no-install-recommends libvulkan1 mesa-vulkan-drivers" >&2
            echo "or set PACKSTONE_ALLOW_NO_GPU=1 to let the GPU tests pass untested." >&2
            exit 1
        fi
        sudo=sudo
    fi
    $sudo apt-get update -q
    $sudo apt-get install -y --no-install-recommends libvulkan1 mesa-vulkan-drivers
fi
# Tests are small and run side by side: threads of the software driver would cost more than they give.
LP_NUM_THREADS="${LP_NUM_THREADS:-0}" cargo test --release "$@"
