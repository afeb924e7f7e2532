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
    [ "$(id -u)" = 0 ] || sudo=sudo
    $sudo apt-get update -q
    $sudo apt-get install -y --no-install-recommends libvulkan1 mesa-vulkan-drivers
fi
cargo test --release "$@"
