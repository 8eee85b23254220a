"""Files in, regular ones and bounded; files out, written aside and renamed into place, whole or not at all."""

import contextlib
import os
import secrets
import stat
from collections.abc import Iterator
from pathlib import Path
from typing import IO

from greensward.interrupts import held_back
from greensward.scene.errors import GreenswardError, InputError

_READ = os.O_RDONLY | getattr(os, "O_NONBLOCK", 0) | getattr(os, "O_CLOEXEC", 0) | getattr(os, "O_BINARY", 0)
_GROUP = "/sys/fs/cgroup/memory"
_GROUP_MEMORY = (
    (f"{_GROUP}.max", f"{_GROUP}.current"),
    (f"{_GROUP}/memory.limit_in_bytes", f"{_GROUP}/memory.usage_in_bytes"),
)
"""Limit and use of a container, as version 2 and version 1 of cgroups report them."""
_CREATE = os.O_WRONLY | os.O_CREAT | os.O_EXCL | getattr(os, "O_NOFOLLOW", 0) | getattr(os, "O_BINARY", 0)


def is_there(path: Path) -> bool:
    """Return whether a file has this name, which may be none that a file can have."""
    try:
        return path.exists()
    except (OSError, ValueError):
        return False


def open_file(path: Path, may_be_empty: bool = False) -> IO[bytes]:
    """Open a regular file, not an empty one; a pipe or a device is refused and never waited for.

    Raises `InputError`.
    """
    try:
        if path.is_dir():
            raise InputError(f"{path}: is a folder, not a file")
        handle = os.open(path, _READ)
        status = os.fstat(handle)
        regular = stat.S_ISREG(status.st_mode)
        if not regular or not (status.st_size or may_be_empty):
            os.close(handle)
            raise InputError(f"{path}: is empty (0 bytes)" if regular else f"{path}: is not a file")
        return os.fdopen(handle, "rb")
    except FileNotFoundError:
        raise InputError(f"{path}: no such file") from None
    except (OSError, ValueError) as error:
        raise InputError(f"{path}: cannot be read: {getattr(error, 'strerror', None) or error}") from None


def read_file(path: Path, most_bytes: int, what: str, may_be_empty: bool = False) -> bytes:
    """The bytes of a regular file, which is `what`. Raises `InputError`, also where it holds more than the limit."""
    with open_file(path, may_be_empty) as stream:
        size = os.fstat(stream.fileno()).st_size
        if size > most_bytes:
            raise InputError(f"{path}: is larger than {what} can be ({most_bytes >> 20:,} MiB)")
        return stream.read(most_bytes)


def free_memory() -> int:
    """Free memory of the machine, or of what this process may take of it, in bytes; 2 GiB where neither is known."""
    known = [_available_kib() * 1024]
    for limit, used in _GROUP_MEMORY:
        with contextlib.suppress(OSError, ValueError):  # "max" where there is no limit
            known.append(int(Path(limit).read_text("ascii")) - int(Path(used).read_text("ascii")))
    return max(min(known), 0)


def _available_kib() -> int:
    try:
        lines = Path("/proc/meminfo").read_text("ascii").splitlines()
    except OSError:
        return 2 << 20
    return next(int(line.split()[1]) for line in lines if line.startswith("MemAvailable"))


def check_memory(path: object, needed: float, cure: str) -> None:
    """Raise `InputError` where reading a file needs more bytes of memory than are free."""
    if needed > (free := free_memory()):
        raise InputError(
            f"{path}: needs about {needed / 2**30:,.1f} GiB of memory, and {free / 2**30:,.1f} GiB are free; {cure}"
        )


@contextlib.contextmanager
def written_aside(path: Path) -> Iterator[IO[bytes]]:
    """A stream whose bytes become the file `path` at the end, whole; on any error `path` stays as it was.

    A file that is replaced hands on its mode and owner. A link stays, and what it leads to is replaced.
    Raises `GreenswardError`.
    """
    aside: Path | None = None
    try:
        with held_back():
            target = _target(path)
            aside = target.parent / f".{secrets.token_hex(8)}.part"
            stream = os.fdopen(os.open(aside, _CREATE, 0o666), "wb")
        with stream:
            _inherit(stream.fileno(), target)
            yield stream
        with held_back():
            aside.replace(target)
            aside = None
    except OSError as error:
        raise GreenswardError(f"{path}: cannot be written: {error.strerror or error}") from None
    except ValueError as error:
        raise GreenswardError(f"{path}: cannot be written: {error}") from None
    finally:
        if aside:
            with held_back(), contextlib.suppress(OSError, ValueError):
                aside.unlink(missing_ok=True)


def check_writable(path: Path, endings: tuple[str, ...]) -> None:
    """Raise `InputError` if a file cannot be written there, which is best known before hours of work."""
    if path.suffix.lower() not in endings:
        got = f"got {path.suffix}" if path.suffix else "it has none"
        raise InputError(f"{path}: the file's name must end in one of {', '.join(endings)} ({got})")
    try:
        if path.is_dir():
            raise InputError(f"{path}: is a folder, and the output must be a file")
        folder = _target(path).parent
        if not folder.is_dir():
            raise InputError(f"{path}: there is no folder {folder}; make it first")
        if path.exists() and not path.is_file():
            raise InputError(f"{path}: is not a file, and the output must be one")
        trial = folder / f".{secrets.token_hex(8)}.part"
        with held_back():
            os.close(os.open(trial, _CREATE, 0o666))
            trial.unlink()
        path.stat()
    except FileNotFoundError:
        return
    except (OSError, ValueError) as error:
        raise InputError(f"{path}: cannot be written: {getattr(error, 'strerror', None) or error}") from None


def check_new_folder(folder: Path) -> None:
    """Raise `InputError` where a folder is neither new nor empty."""
    try:
        if folder.exists() and not folder.is_dir():
            raise InputError(f"{folder}: is a file; name a folder that is new or empty")
        if folder.exists() and any(folder.iterdir()):
            raise InputError(f"{folder}: is not empty; name a folder that is new or empty")
    except (OSError, ValueError) as error:
        raise InputError(f"{folder}: cannot be made: {getattr(error, 'strerror', None) or error}") from None


def _target(path: Path) -> Path:
    """The file that is replaced: where a link leads, unless somebody else put it into a folder that all may write.

    The rule is that of `protected_symlinks` (proc(5)).
    """
    if not path.is_symlink():
        return path
    if hasattr(os, "geteuid"):
        folder, link = path.parent.stat(), path.lstat()
        shared = folder.st_mode & stat.S_ISVTX and folder.st_mode & stat.S_IWOTH
        if shared and link.st_uid not in (os.geteuid(), folder.st_uid):
            raise PermissionError(0, "it is a link that another user put into a shared folder; remove it")
    return Path(os.path.realpath(path))


def _inherit(handle: int, target: Path) -> None:
    """Give a new file the mode and the owner of the one that it replaces."""
    try:
        before = target.stat()
    except OSError:
        return
    with contextlib.suppress(OSError, AttributeError):  # Windows has neither
        os.fchown(handle, before.st_uid, before.st_gid)
    with contextlib.suppress(OSError, AttributeError):
        os.fchmod(handle, stat.S_IMODE(before.st_mode))
