#!/usr/bin/env bash
# Looks for data races under ThreadSanitizer: unit tests of the threads, and steps of worlds in groups, in colors and in
# batches with two and three threads. Needs a nightly toolchain with the component rust-src, since the standard library is
# built with the sanitizer as well. Takes a quarter of an hour on two cores.
set -euo pipefail
cd "$(dirname "$0")/.."

export RUSTFLAGS="-Zsanitizer=thread -C target-cpu=x86-64-v3" CARGO_PROFILE_DEV_OPT_LEVEL=1 TSAN_OPTIONS="halt_on_error=1"
tests() {
    cargo +nightly test -Zbuild-std --target x86_64-unknown-linux-gnu --target-dir target/sanitize "$@"
}
tests -p simpulse-engine --lib -- workers
tests -p simpulse --test lab -- threads:: batch::
