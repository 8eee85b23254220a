# shellcheck shell=bash
# Sourced by the scripts beside it: finds Python and OpenGL, installs what is missing, fills .venv.
# It sets `root` and `python`, and speaks on standard error.

root=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
python=$root/.venv/bin/python
gl_packages="libegl1 libgl1 libgl1-mesa-dri"

say() { printf '%s\n' "$*" >&2; }

stop() {
  say "$*"
  exit 1
}

# Run a long command silently; on failure show the end of what it said.
quietly() {
  local log
  log=$(mktemp)
  if "$@" >"$log" 2>&1 </dev/null; then
    rm -f "$log"
  else
    tail -n 15 "$log" >&2
    rm -f "$log"
    return 1
  fi
}

# Install Debian packages, or tell the line that does.
install_packages() {
  local line="sudo apt install $*" as_root=()
  command -v apt-get >/dev/null || stop "Please install what Debian calls $* with this system's package manager."
  if [ "$(id -u)" != 0 ]; then
    if command -v sudo >/dev/null && { sudo -n true 2>/dev/null || [ -t 0 ]; }; then
      as_root=(sudo)
      sudo -v || stop "Please run: $line"
    else
      stop "Something is missing. Please run: $line"
    fi
  fi
  say "Installing $* with apt ..."
  export DEBIAN_FRONTEND=noninteractive
  # the lists are fetched only if they turn out to be missing or old
  "${as_root[@]}" apt-get install -y --no-install-recommends "$@" >/dev/null 2>&1 </dev/null ||
    { quietly "${as_root[@]}" apt-get update &&
      quietly "${as_root[@]}" apt-get install -y --no-install-recommends "$@"; } ||
    stop "That failed. Please run: $line"
}

# Print the first Python that is new enough and can make virtual environments; else tell what keeps us from it.
find_python() {
  local candidate old="" bare=""
  for candidate in ${PYTHON:-python3 python3.14 python3.13 python3.12 python3.11}; do
    if "$candidate" -c 'import sys; sys.exit(sys.version_info < (3, 11))' 2>/dev/null; then
      if "$candidate" -c 'import ensurepip, venv' 2>/dev/null; then
        printf '%s\n' "$candidate"
        return
      fi
      bare=${bare:-$("$candidate" -c 'import sys; print("python%d.%d-venv" % sys.version_info[:2])')}
    else
      old=${old:-$("$candidate" --version 2>/dev/null || true)}
    fi
  done
  [ -z "$bare" ] || { printf 'missing %s\n' "$bare" && return; }
  [ -n "$old" ] || [ -n "${PYTHON:-}" ] || { printf 'missing python3 python3-venv\n' && return; }
  printf 'too old: %s\n' "${old:-nothing that runs as $PYTHON}"
}

# Does an OpenGL driver start? The argument "software" asks for the one that draws on the CPU.
gl_works() {
  "$1" - "${2:-any}" 2>/dev/null <<'PROBE'
import ctypes, sys

egl = ctypes.CDLL("libEGL.so.1")
egl.eglGetProcAddress.restype = ctypes.c_void_p


def get(name, result, *arguments):
    return ctypes.CFUNCTYPE(result, *arguments)(egl.eglGetProcAddress(name))


pointer, number = ctypes.c_void_p, ctypes.c_int
devices, count = (pointer * 64)(), number()
get(b"eglQueryDevicesEXT", number, number, pointer, pointer)(64, devices, ctypes.byref(count))
text = get(b"eglQueryDeviceStringEXT", ctypes.c_char_p, pointer, number)
display = get(b"eglGetPlatformDisplayEXT", pointer, number, pointer, pointer)
start = get(b"eglInitialize", number, pointer, pointer, pointer)
for device in devices[: count.value]:
    software = b"EGL_MESA_device_software" in (text(device, 0x3055) or b"")
    if (software or sys.argv[1] == "any") and start(display(0x313F, device, None), None, None):
        sys.exit(0)
sys.exit(1)
PROBE
}

# Are these shared libraries there?
loads() {
  "$python" -c 'import ctypes, sys; [ctypes.CDLL(name) for name in sys.argv[1:]]' "$@" 2>/dev/null
}

fill_venv() {
  local base=$1 extras=$2 stamp now
  if [ -e "$root/.venv" ] && ! "$python" -c 'import pip, sys; sys.exit(sys.version_info < (3, 11))' 2>/dev/null; then
    say "Starting over: .venv is broken ..."
    rm -rf "$root/.venv"
  fi
  stamp=$root/.venv/installed-${extras:-plain}
  # the path too: an environment that was moved points to where it was
  now=$({ printf '%s\n' "$root" && cat "$root/pyproject.toml" "$root/constraints.txt"; } | sha256sum)
  # whichever extras were installed, the package itself came with them
  if [ -z "$extras" ]; then grep -qsxF -- "$now" "$root"/.venv/installed-* && return; fi
  [ "$(cat "$stamp" 2>/dev/null)" != "$now" ] || return 0
  if [ ! -e "$root/.venv" ]; then
    say "Making .venv with $("$base" --version) ..."
    quietly "$base" -m venv "$root/.venv" || { rm -rf "$root/.venv" && stop "The virtual environment could not be made."; }
  fi
  say "Installing greensward${extras:+ with what \"$extras\" needs} into .venv ..."
  # modules are compiled when they are first imported, which is sooner done than all of them now
  quietly "$python" -m pip install --quiet --no-compile --disable-pip-version-check --retries 2 \
    -c "$root/constraints.txt" -e "$root${extras:+[$extras]}" ||
    stop "That failed; is there a network? What was installed before is still in .venv."
  printf '%s' "$now" >"$stamp"
}

# setup EXTRAS [any|software|none]: the second says which OpenGL driver is needed.
setup() {
  local base probe missing=() driver=${2:-any}
  [ "$(uname -s)" != Darwin ] ||
    stop "macOS offers OpenGL 4.1 at most and greensward needs 4.3: use Linux or Windows, or a Linux container."
  base=$(find_python)
  probe=$base
  case $base in
    "too old:"*) stop "greensward needs Python 3.11 or newer (found ${base#too old: }). Install one, then: PYTHON=python3.11 $0" ;;
    "missing "*)
      # shellcheck disable=SC2206  # package names, one a word
      missing=(${base#missing })
      probe=python3
      ;;
  esac
  if [ "$driver" != none ] && ! gl_works "$probe" "$driver"; then
    # shellcheck disable=SC2206
    missing+=($gl_packages)
  fi
  if [ ${#missing[@]} -gt 0 ]; then
    install_packages "${missing[@]}"
    base=$(find_python)
    case $base in
      "too old:"* | "missing "*) stop "greensward needs Python 3.11 or newer, with venv ($base). Install one, then: PYTHON=python3.11 $0" ;;
    esac
    [ "$driver" = none ] || gl_works "$base" "$driver" ||
      stop "No OpenGL driver starts, though these are installed: $gl_packages"
  fi
  fill_venv "$base" "$1"
}
