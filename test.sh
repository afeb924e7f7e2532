#!/usr/bin/env bash
# Runs all tests. On a Debian or Ubuntu machine without any Vulkan driver it first installs Mesa's software one, because
# the GPU path is tested everywhere. Where that is impossible, PACKSTONE_ALLOW_NO_GPU=1 lets the GPU tests pass untested.
set -euo pipefail
cd "$(dirname "$0")"

driver_found() { compgen -G '/usr/share/vulkan/icd.d/*.json' >/dev/null || compgen -G '/etc/vulkan/icd.d/*.json' >/dev/null || [ -n "${VK_DRIVER_FILES:-}" ]; }

if [ "$(uname -s)" = Linux ] && ! driver_found && [ "${PACKSTONE_ALLOW_NO_GPU:-}" != 1 ]; then
    echo "no Vulkan driver found: installing Mesa's software driver"
    sudo=""; [ "$(id -u)" = 0 ] || sudo=sudo
    $sudo apt-get update -q
    $sudo apt-get install -y --no-install-recommends libvulkan1 mesa-vulkan-drivers
fi
# Mesa complains on stderr where a session has no runtime directory.
export XDG_RUNTIME_DIR="${XDG_RUNTIME_DIR:-$(mktemp -d)}"
cargo test --release "$@"
