"""Write files: completely or not at all, flushed to disk, with one writer per target.

Conventions: links are followed before anything is locked or written. An incomplete file is named
`.cdtool-<target>-<random>.tmp` and its lock `.cdtool-<target>.lock`, where <target> is a hash of the name. Both are
dotfiles, which patterns for logs do not match, and exist only while a command writes. Files left by a killed command
are removed by the next command that writes to the folder, once no living process holds the lock. An existing file keeps
its mode (and owner, if permitted); a new one gets the mode set by the umask.

At a URL a file is written locally, and then uploaded in one step: an object is there completely or not at all. An
object store has no locks: of two writers, the last one wins. Only `locked` notices on S3 that another process has
replaced the object meanwhile. Several files, or those of a folder, are uploaded one after the other.
"""

from __future__ import annotations

import atexit
import errno
import os
import shutil
import stat
import tempfile
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager, suppress
from pathlib import Path

from cdtool.base.errors import CdtoolError, OutputError, UsageError
from cdtool.base.files.locks import holding, release_all, temporary_name
from cdtool.base.plain_text import plain
from cdtool.base.remote import staging, storage
from cdtool.base.remote.remote_path import is_remote
from cdtool.base.remote.storage import StorageError

_BINARY = getattr(os, "O_BINARY", 0) | getattr(os, "O_NOFOLLOW", 0) | getattr(os, "O_CLOEXEC", 0)
_temporaries: set[Path] = set()
# The ETag of each file at a URL that is being updated: `locked`.
_expected: dict[Path, str] = {}
_UNABLE = (errno.ENOSYS, errno.EINVAL, errno.EXDEV, errno.EBUSY, errno.EOPNOTSUPP, errno.EPERM)


@contextmanager
def locked(path: Path) -> Iterator[Path]:
    """Lock `path` for reading, changing and writing it; yield its real path.

    Files written with this module inside the block use the same lock. Raises OutputError if another process holds the
    lock for a minute, or the file system has no locks.
    """
    if is_remote(path):
        with _explained(path, []):
            found = staging.current_info(str(path)) if path.exists() else None
            _expected[path] = found.etag if found else ""
            try:
                yield path
            finally:
                del _expected[path]
        return
    target = resolved(path)
    with _explained(path, []), holding(target, target.parent, path, needed=True):
        yield target


def write_bytes(path: Path, content: bytes) -> None:
    """Write a complete file; write to a device or pipe directly. Raises OutputError, UsageError."""
    _write(path, (content,))


def write_text(path: Path, text: str) -> None:
    """Write a complete file of UTF-8 text without changing its line ends. Raises OutputError, UsageError."""
    write_pieces(path, (text,))


def write_texts(texts: Mapping[Path, str]) -> None:
    """Write each text as `write_text` does; several are replaced together, or none. Raises OutputError."""
    if len(texts) == 1:
        for path, text in texts.items():
            write_text(path, text)
    elif texts:
        with replaced(*texts) as parts:
            for part, text in zip(parts, texts.values(), strict=True):
                part.write_bytes(text.encode("utf-8", "replace"))


def write_pieces(path: Path, pieces: Iterable[str]) -> None:
    """Write a complete file of UTF-8 text that is made piece by piece. Raises OutputError, UsageError."""
    _write(path, (piece.encode("utf-8", "replace") for piece in pieces))


def _write(path: Path, contents: Iterable[bytes]) -> None:
    if not is_remote(path) and _is_special(path):
        with _explained(path, []), path.open("wb") as stream:
            stream.writelines(contents)
        return
    with replaced(path) as (part,), part.open("wb") as stream:
        stream.writelines(contents)


@contextmanager
def replaced(*paths: Path) -> Iterator[list[Path]]:
    """Yield an empty temporary file for each of `paths`; if the block ends without error, all replace their targets.

    Otherwise none does. Raises UsageError if a path is a folder, a device, a link to a missing file, or its folder is
    missing; OutputError if writing fails, in the block or after it.
    """
    if any(is_remote(path) for path in paths):
        with _uploaded(paths) as made:
            yield made
        return
    targets = [_checked(path) for path in paths]
    parts = [temporary_name(target, target.parent) for target in targets]
    names = list(zip(parts, paths, strict=True))
    with _explained(paths[0], names), ExitStack() as stack:
        for path, target in sorted(zip(paths, targets, strict=True), key=lambda item: item[1]):
            stack.enter_context(holding(target, target.parent, path))
        try:
            for part, target in zip(parts, targets, strict=True):
                _temporaries.add(part)
                os.close(os.open(part, os.O_CREAT | os.O_EXCL | os.O_RDWR | _BINARY, _mode(target) | 0o600))
            yield parts
            for part, target in zip(parts, targets, strict=True):
                _finish(part, target)
            _put_in_place(list(zip(parts, targets, strict=True)))
            for folder in {target.parent for target in targets}:
                _flush(folder)
        finally:
            _discard(parts)


@contextmanager
def replaced_folder(path: Path, may_replace: Callable[[Path], bool] | None = None) -> Iterator[Path]:
    """Yield a temporary folder that becomes `path` if the block ends without error; creates missing parents.

    `may_replace(folder)` returns whether all content of an existing folder may be removed; it raises if nothing may be
    written there. If some content must stay, or the folder cannot be exchanged (a mount point, the current folder, a
    file system without exchange), each file replaces the one of the same name and the others stay. Raises as
    `replaced`.
    """
    if is_remote(path):
        with _uploaded_folder(path, may_replace) as made:
            yield made
        return
    target = resolved(path)
    if target.exists() and not target.is_dir():
        raise UsageError(f"{plain(path)}: exists and is not a folder", "choose another name")
    if target.exists() and not os.access(target, os.W_OK | os.X_OK):
        raise OutputError(f"{plain(path)}: cannot be written: {os.strerror(errno.EACCES)}", "check its permissions")
    whole = not _has_to_stay(target) and (may_replace is None or not target.exists() or may_replace(target))
    place = target.parent if whole else target
    part = temporary_name(target, place)
    with made_folder(target.parent), _explained(path, [(part, path)]), holding(target, place, path):
        try:
            _temporaries.add(part)
            part.mkdir()
            yield part
            _flush_tree(part)
            if target.exists() and may_replace is not None:  # its content may have changed meanwhile
                whole = may_replace(target) and whole
            if not (whole and _put_whole(part, target)):
                _put_in_place([(item, target / item.name) for item in sorted(part.iterdir())])
                _flush(target)
            _flush(place)
        finally:
            _discard([part])


@contextmanager
def made_folder(path: Path) -> Iterator[Path]:
    """Create a folder with its missing parents; on exit remove those that are still empty."""
    if is_remote(path):
        yield path
        return
    target = resolved(path)
    made = [folder for folder in (target, *target.parents) if not folder.exists()]
    try:
        with _explained(path, []):
            target.mkdir(parents=True, exist_ok=True)
        yield target
    finally:
        for folder in made:
            with suppress(OSError):
                folder.rmdir()


def resolved(path: Path) -> Path:
    """Return the real path; raises UsageError for a link to a missing file."""
    if is_remote(path):
        return path
    if path.is_symlink() and not path.exists():
        raise UsageError(f"{plain(path)}: is a link to a missing file", "remove or repair the link")
    return Path(os.path.realpath(path))


def clean_up() -> None:
    """Remove the temporary files and locks of this process: a signal can raise an exception between any two steps."""
    _discard(list(_temporaries))
    release_all()


@contextmanager
def _uploaded(paths: Sequence[Path]) -> Iterator[list[Path]]:
    """Yield a local file for each path; if the block ends without error, those at URLs are uploaded.

    The local ones among them are put in place first.
    """
    local = [path for path in paths if not is_remote(path)]
    with tempfile.TemporaryDirectory(prefix="cdtool-") as folder, ExitStack() as stack:
        names = {path: Path(folder) / f"{i}{path.suffix}" for i, path in enumerate(paths) if is_remote(path)}
        with _explained(paths[0], [(name, path) for path, name in names.items()]):
            names |= dict(zip(local, stack.enter_context(replaced(*local)) if local else (), strict=True))
            yield [names[path] for path in paths]
            stack.close()
            for path in (path for path in paths if is_remote(path)):
                _upload(path, names[path])


@contextmanager
def _uploaded_folder(path: Path, may_replace: Callable[[Path], bool] | None) -> Iterator[Path]:
    """Yield a local folder whose files are uploaded if the block ends without error; see `replaced_folder`.

    What the folder had before is removed at the end if all of it may be replaced.
    """
    whole = path.is_dir() and (may_replace is None or may_replace(path))
    with tempfile.TemporaryDirectory(prefix="cdtool-") as folder, _explained(path, [(Path(folder), path)]):
        yield Path(folder)
        for item in sorted(Path(folder).rglob("*")):
            if item.is_file():
                _upload(path / item.relative_to(folder).as_posix(), item)
        for old in list(path.glob("**/*")) if whole else ():
            if old.is_file() and not (Path(folder) / old.relative_to(path)).exists():
                old.unlink(missing_ok=True)


def _upload(path: Path, file: Path) -> None:
    with _explained(path, []):
        try:
            storage.put(str(path), file, _expected.get(path, ""))
        finally:
            staging.forget(str(path))


def _checked(path: Path) -> Path:
    if path.is_dir():
        raise UsageError(f"{plain(path)}: is a folder", "give the name of a file")
    if _is_special(path):
        raise UsageError(f"{plain(path)}: is not a regular file", "give the name of a file")
    target = resolved(path)
    if not target.parent.is_dir():
        raise UsageError(f"{plain(path)}: no folder {plain(path.parent)}", "create the folder first")
    if target.exists() and not os.access(target, os.W_OK):
        raise OutputError(f"{plain(path)}: cannot be written: {os.strerror(errno.EACCES)}", "check its permissions")
    return target


def _is_special(path: Path) -> bool:
    """Whether a path is a device or a pipe, which cannot be replaced by renaming."""
    return path.exists() and not path.is_file() and not path.is_dir()


@contextmanager
def _explained(path: Path, names: Sequence[tuple[Path, Path]]) -> Iterator[None]:
    """Convert an OSError to one line about `path` that does not name temporary files."""
    try:
        yield
    except StorageError as fault:
        if fault.url != str(path):  # of a file that is read in the block
            raise
        raise OutputError(f"{plain(path)}: cannot be written: {fault.strerror}", fault.hint) from fault
    except CdtoolError as fault:
        message = fault.message
        for part, known in names:
            message = message.replace(str(part), str(known))
        if message == fault.message:
            raise
        raise type(fault)(message, fault.hint) from fault
    except OSError as fault:
        why = os.strerror(fault.errno) if fault.errno else " ".join(str(fault).split())[:200]
        for part, known in names:
            why = why.replace(str(part), str(known))
        raise OutputError(f"{plain(path)}: cannot be written: {why}", "check the folder and its space") from fault


def _mode(target: Path) -> int:
    return stat.S_IMODE(target.stat().st_mode) if target.exists() else 0o666


def _finish(part: Path, target: Path) -> None:
    """Flush a file, and give it the mode and owner of the file that it replaces."""
    _flush(part)
    if target.exists():
        kept = target.stat()
        if hasattr(os, "chown") and (kept.st_uid, kept.st_gid) != (part.stat().st_uid, part.stat().st_gid):
            with suppress(OSError):
                os.chown(part, kept.st_uid, kept.st_gid)
        part.chmod(stat.S_IMODE(kept.st_mode))


def _put_in_place(pairs: Sequence[tuple[Path, Path]]) -> None:
    """Rename each file to its target; if one fails, undo the others.

    Killed meanwhile, the process leaves no old file beside a new one: all but the first are set aside before that is
    replaced. What cannot be put back, because the file system refuses that too, stays under its hidden name.
    """
    existing = [target for _, target in pairs if target.exists()]
    old = {target: temporary_name(target, pairs[0][0].parent, ".old") for target in existing if len(pairs) > 1}
    try:
        for target in (target for _, target in pairs[1:] if target in old):
            target.rename(old[target])
        for part, target in pairs:
            if target in old and not old[target].exists():
                try:
                    os.link(target, old[target])
                except OSError:  # a file system without hard links, or a folder
                    target.rename(old[target])
            part.replace(target)
        _temporaries.update(old.values())  # a signal from now on ends the process without them
    except BaseException:
        for part, target in reversed(pairs):
            with suppress(OSError):
                if target in old and part.exists() and target.exists():
                    _remove(old[target])
                elif target in old:
                    old[target].replace(target)
                elif target not in existing and not part.exists():
                    _remove(target)
        raise
    _discard(list(old.values()))


def _put_whole(part: Path, target: Path) -> bool:
    """Rename a folder to its target; return False if the file system cannot exchange it for the existing one."""
    if not target.exists():
        part.rename(target)
        return True
    part.chmod(stat.S_IMODE(target.stat().st_mode))
    return _exchange(part, target)


def _exchange(first: Path, second: Path) -> bool:
    """Exchange two folders in one call (Linux: renameat2); return False if not supported; raises OSError."""
    import ctypes

    try:
        call = ctypes.CDLL(None, use_errno=True).renameat2
    except (AttributeError, OSError, TypeError):
        return False
    if call(-100, os.fsencode(first), -100, os.fsencode(second), 2) == 0:  # AT_FDCWD twice, RENAME_EXCHANGE
        return True
    fault = ctypes.get_errno()
    if fault in _UNABLE:
        return False
    raise OSError(fault, os.strerror(fault), str(second))


def _has_to_stay(folder: Path) -> bool:
    """Whether an existing folder must not be renamed: a mount point, the current folder, or in a read-only folder."""
    if not folder.is_dir():
        return False
    try:
        inside = Path(os.path.realpath(Path.cwd())).is_relative_to(folder)
    except FileNotFoundError:  # the current folder is gone
        inside = False
    # Path.is_mount is not available on Windows before Python 3.12.
    return inside or os.path.ismount(folder) or not os.access(folder.parent, os.W_OK | os.X_OK)


def _flush(path: Path) -> None:
    """Flush a file's content, or a folder's names, to disk."""
    if path.is_dir() and not hasattr(os, "O_DIRECTORY"):
        return  # Windows: a folder cannot be flushed
    handle = os.open(path, os.O_RDONLY if path.is_dir() else os.O_RDWR | _BINARY)
    try:
        os.fsync(handle)
    finally:
        os.close(handle)


def _flush_tree(folder: Path) -> None:
    for path in sorted(folder.rglob("*")):
        _flush(path)
    _flush(folder)


def _discard(parts: Sequence[Path]) -> None:
    for part in parts:
        with suppress(OSError):
            _remove(part)
        _temporaries.discard(part)


def _remove(path: Path) -> None:
    if path.is_dir():
        shutil.rmtree(path)
    else:
        path.unlink(missing_ok=True)


atexit.register(clean_up)
if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=_temporaries.clear)  # these belong to the parent
