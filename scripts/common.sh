# shellcheck shell=bash disable=SC2034
# What the scripts share; sourced, never run. Each script calls `need` for what it uses itself.

root="$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)"
cd "$root" || exit

jobs="${THRONG_JOBS:-$(nproc)}"
# Warnings are errors where the compilers are ours to choose; a user's newer one may know more.
werror="${THRONG_WERROR:-OFF}"

build_packages=(g++ cmake ninja-build pkg-config libtbb-dev libhwy-dev)
program_packages=("${build_packages[@]}" libcli11-dev libfmt-dev nlohmann-json3-dev libcairo2-dev)
# Engines that there are adapters for: their tests, and throng-simulate, are built where they are.
engine_packages=(libbullet-dev libfcl-dev)
test_packages=("${program_packages[@]}" "${engine_packages[@]}" libgtest-dev librapidcheck-dev)
# The search across ranks, and its tests, are built where MPI is.
mpi_packages=(libopenmpi-dev openmpi-bin)
rival_packages=("${engine_packages[@]}" libembree-dev libcgal-dev)
docs_packages=(doxygen python3-venv)
# Of PyPI, for the site.
docs_modules=(sphinx breathe myst-parser furo numpy)
# Ubuntu's package of that name is a shell for something else.
browser_packages=()
if grep -qs '^ID=debian' /etc/os-release; then browser_packages=(chromium); fi
# Another processor's compiler, and what runs its programs.
arm_packages=(g++-aarch64-linux-gnu qemu-user googletest)
check_packages=("${test_packages[@]}" "${mpi_packages[@]}" "${docs_packages[@]}" "${arm_packages[@]}" "${browser_packages[@]}" dpkg-dev file clang
  clang-format-14 clang-tidy cppcheck shellcheck ccache python3 binutils python3-dev python3-venv)

say() { printf '\n== %s\n' "$*"; }
fail() { printf '%s: %s\n' "${0##*/}" "$*" >&2; exit 1; }
have() { command -v "$1" > /dev/null 2>&1; }

# The packages of its arguments that are not installed.
missing_packages() {
  local package
  for package in "$@"; do
    dpkg-query -W -f '${db:Status-Status}\n' "$package" 2> /dev/null | grep -qx installed ||
      printf '%s\n' "$package"
  done
}

# Installs what is missing of its arguments, and asks the network for nothing where nothing is.
need() {
  if ! have apt-get; then
    echo "Not a Debian or Ubuntu: taking for granted that these are here: $*"
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

# Settings that a build folder takes when it is made, and ignores afterwards.
use_ninja_and_ccache() {
  if have ninja; then export CMAKE_GENERATOR="${CMAKE_GENERATOR:-Ninja}"; fi
  if have ccache; then
    export CMAKE_CXX_COMPILER_LAUNCHER="${CMAKE_CXX_COMPILER_LAUNCHER:-ccache}"
    # Without these it caches nothing that has a precompiled header.
    export CCACHE_SLOPPINESS="${CCACHE_SLOPPINESS:-pch_defines,time_macros}"
    # What a file includes it takes from the compiler, and does not run the preprocessor first: a tenth of
    # the time where the cache is empty.
    export CCACHE_DEPEND="${CCACHE_DEPEND:-true}"
    # A header of which a comment alone has changed is another one to a precompiled header, which knows it by all its
    # bytes: from the cache would come the old one, and everything in it be defined twice.
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

# Clang's sanitizers and libFuzzer, in a folder of their own: one that changes its compiler loses its settings.
configure_with_fuzzers() { configure asan -B build/fuzz -DCMAKE_CXX_COMPILER=clang++ -DTHRONG_FUZZ=ON "$@"; }

# build FOLDER [TARGET...]
build() {
  local folder="$1" targets=()
  shift
  [ "$#" -eq 0 ] || targets=(--target "$@")
  cmake --build "$folder" -j "$jobs" "${targets[@]}"
}

# Whether PyPI, or what stands in for it here, has any package for us: where it has, one that cannot be
# installed is a fault.
pypi_answers() {
  local room answer=0
  room="$(mktemp -d)"
  python3 -m venv "$room/venv"
  "$room/venv/bin/pip" download --quiet --disable-pip-version-check --retries 1 --no-cache-dir --no-deps -d "$room" wheel || answer=1
  rm -rf "$room"
  return "$answer"
}

seconds_since() { printf '%d s' "$(($(date +%s) - $1))"; }
