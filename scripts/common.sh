# shellcheck shell=bash disable=SC2034
# Shared by the scripts; sourced, never run. Each script calls `need` for its packages.

root="$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)"
cd "$root" || exit

jobs="${THRONG_JOBS:-$(nproc 2> /dev/null || getconf _NPROCESSORS_ONLN)}"  # macOS has no nproc
# Warnings are errors only where the project chooses the compilers; a user's newer one may have more warnings.
werror="${THRONG_WERROR:-OFF}"

build_packages=(g++ cmake ninja-build pkg-config libtbb-dev libhwy-dev)
program_packages=("${build_packages[@]}" libcli11-dev libfmt-dev nlohmann-json3-dev libcairo2-dev)
# Engines with an adapter: if installed, their tests and throng-simulate are built.
engine_packages=(libbullet-dev libfcl-dev)
test_packages=("${program_packages[@]}" "${engine_packages[@]}" libgtest-dev librapidcheck-dev libgmp-dev)
# If MPI is installed, the search across ranks and its tests are built.
mpi_packages=(libopenmpi-dev openmpi-bin)
competitor_packages=("${engine_packages[@]}" libembree-dev libcgal-dev)
docs_packages=(doxygen python3-venv)
# PyPI packages for the site.
docs_modules=(sphinx breathe myst-parser furo numpy)
# Ubuntu's package of chromium only installs a snap, and it has no libraries for WebAssembly.
browser_packages=()
wasm_packages=(cmake ninja-build libhwy-dev)
if grep -qs '^ID=debian' /etc/os-release; then
  browser_packages=(chromium)
  wasm_packages+=(clang-22 lld-22 llvm-22 libc++-22-dev-wasm32 libc++abi-22-dev-wasm32 libclang-rt-22-dev-wasm32 wasi-libc)
fi
web_packages=("${wasm_packages[@]}" nodejs node-typescript)
# A cross compiler, and the emulator for its programs.
arm_packages=(g++-aarch64-linux-gnu qemu-user googletest)
windows_packages=(g++-mingw-w64-x86-64 wine wine64 googletest)
check_packages=("${test_packages[@]}" "${mpi_packages[@]}" "${docs_packages[@]}" "${arm_packages[@]}" "${windows_packages[@]}" "${web_packages[@]}"
  "${browser_packages[@]}" dpkg-dev file clang clang-format-14 clang-tidy cppcheck shellcheck ccache python3 binutils python3-dev python3-venv)

say() { printf '\n== %s\n' "$*"; }
fail() { printf '%s: %s\n' "${0##*/}" "$*" >&2; exit 1; }
have() { command -v "$1" > /dev/null 2>&1; }

# Prints those of its arguments that are not installed.
missing_packages() {
  local package
  for package in "$@"; do
    dpkg-query -W -f '${db:Status-Status}\n' "$package" 2> /dev/null | grep -qx installed ||
      printf '%s\n' "$package"
  done
}

# Installs the missing ones of its arguments; does not use the network if there are none.
need() {
  if ! have apt-get; then
    echo "Not Debian or Ubuntu: assuming that these are installed: $*"
    return
  fi
  local missing
  mapfile -t missing < <(missing_packages "$@")
  if [ "${#missing[@]}" -eq 0 ]; then return; fi
  local as_root=()
  if [ "$(id -u)" -ne 0 ]; then
    have sudo || fail "these packages are missing, and there is no sudo to install them: ${missing[*]}"
    as_root=(sudo)
  fi
  say "Installing ${missing[*]}"
  "${as_root[@]}" apt-get update -qq
  "${as_root[@]}" env DEBIAN_FRONTEND=noninteractive \
    apt-get install -y -qq --no-install-recommends "${missing[@]}" > /dev/null
}

# A build folder takes these settings when it is created, and ignores them later.
use_ninja_and_ccache() {
  if have ninja; then export CMAKE_GENERATOR="${CMAKE_GENERATOR:-Ninja}"; fi
  if have ccache; then
    export CMAKE_CXX_COMPILER_LAUNCHER="${CMAKE_CXX_COMPILER_LAUNCHER:-ccache}"
    # Otherwise ccache does not cache files with a precompiled header.
    export CCACHE_SLOPPINESS="${CCACHE_SLOPPINESS:-pch_defines,time_macros}"
    # Dependencies come from the compiler instead of a preprocessor run: a tenth of the time with an empty cache.
    export CCACHE_DEPEND="${CCACHE_DEPEND:-true}"
    # A precompiled header depends on every byte of its headers, comments included: without this, a changed comment
    # would combine an old cached header with the new one, and define everything twice.
    export CCACHE_COMMENTS="${CCACHE_COMMENTS:-true}"
  fi
}

# configure PRESET [-D...]: quiet unless it fails.
configure() {
  local log
  log="$(mktemp)"
  if ! cmake --preset "$@" > "$log" 2>&1; then
    cat "$log"
    rm -f "$log"
    fail "cmake --preset $* failed"
  fi
  grep -E '^-- throng|CMake Warning' "$log" || true
  rm -f "$log"
}

# Clang's sanitizers and libFuzzer, in a separate folder: CMake drops a folder's settings when the compiler changes.
configure_with_fuzzers() { configure asan -B build/fuzz -DCMAKE_CXX_COMPILER=clang++ -DTHRONG_FUZZ=ON "$@"; }

# build FOLDER [TARGET...]
build() {
  local folder="$1" targets=()
  shift
  [ "$#" -eq 0 ] || targets=(--target "$@")
  cmake --build "$folder" -j "$jobs" "${targets[@]}"
}

# Whether PyPI (or a mirror) serves any package: if it does, a failed installation is an error.
pypi_is_reachable() {
  local workdir answer=0
  workdir="$(mktemp -d)"
  python3 -m venv "$workdir/venv"
  "$workdir/venv/bin/pip" download --quiet --disable-pip-version-check --retries 1 --no-cache-dir --no-deps -d "$workdir" wheel || answer=1
  rm -rf "$workdir"
  return "$answer"
}

seconds_since() { printf '%d s' "$(($(date +%s) - $1))"; }
