"""Writes files so that each is whole or as it was: beside it first, then under its name.

The rules are those of NewFile (pf_resampling_core/files/new_file.hpp): nothing is written through a symbolic link, into
a FIFO or a device, or over a file that is read-only.
"""
import contextlib
import os
import secrets
import signal
import stat
import sys

REMEDY = "its folder has to exist, to be writable and to have space"


class WriteError(Exception):
    """What cannot be written: one line with its name, the reason and the remedy."""


def is_regular_file(path):
    """Whether a regular file has this name; a link to one is none."""
    try:
        return stat.S_ISREG(os.lstat(path).st_mode)
    except FileNotFoundError:
        return False


def require_writable(path):
    """Raises WriteError unless there is nothing of this name, or a regular file that is not read-only."""
    try:
        mode = os.lstat(path).st_mode
    except FileNotFoundError:
        return
    fault = ""
    if stat.S_ISLNK(mode):
        fault = "it is a symbolic link; remove or rename it"
    elif not stat.S_ISREG(mode):
        fault = f"it is {'a folder' if stat.S_ISDIR(mode) else 'not a regular file'}; remove or rename it"
    elif not (mode & 0o222 and os.access(path, os.W_OK)):  # root could write it all the same
        fault = "it is read-only; make it writable or rename it"
    if fault:
        raise WriteError(f"{path} cannot be written: {fault}")


def create_beside(path, unfinished):
    """Opens a new file beside this one, with its owner and mode if it is there. Notes its name in `unfinished`."""
    try:
        old = os.lstat(path)
    except FileNotFoundError:
        old = None
    # Noted first, for a signal may come at any time. Nobody else can know this name.
    unfinished[path] = f"{path}.part-{os.getpid()}-{secrets.token_hex(8)}"
    try:
        descriptor = os.open(unfinished[path], os.O_WRONLY | os.O_CREAT | os.O_EXCL | os.O_NOFOLLOW,
                             0o600 if old else 0o666)
    except OSError:
        del unfinished[path]  # nothing of ours
        raise
    file = os.fdopen(descriptor, "wb")
    if old:
        # As far as this user can: a file of somebody else becomes one's own.
        bits = 0o7777
        try:
            os.fchown(descriptor, old.st_uid, old.st_gid)
        except OSError:
            bits = 0o777
        os.fchmod(descriptor, old.st_mode & bits)
    return file


@contextlib.contextmanager
def new_file(path):
    """The name of a file to write, which takes the place of `path` when all went well, and is removed otherwise. Raises
    WriteError if it cannot be written."""
    unfinished = {}
    try:
        require_writable(path)
        create_beside(path, unfinished).close()
        yield unfinished[path]
        require_writable(path)  # what is there now
        os.replace(unfinished.pop(path), path)
    except OSError as error:
        raise WriteError(f"{path} cannot be written: {error.strerror}; {REMEDY}") from error
    finally:
        for name in unfinished.values():
            with contextlib.suppress(OSError):
                os.unlink(name)


def write_files(contents):
    """Writes {path: bytes}. If one of them cannot be written, none is: raises WriteError, and leaves no trace."""
    unfinished = {}  # {path: the name that it has until it is whole}
    path = None
    try:
        for path in contents:
            require_writable(path)
        for path, data in contents.items():
            with create_beside(path, unfinished) as file:
                file.write(data)
        for path in contents:
            require_writable(path)  # what is there now
        for path in contents:
            os.replace(unfinished[path], path)
            del unfinished[path]
    except OSError as error:
        raise WriteError(f"{path} cannot be written: {error.strerror}; {REMEDY}") from error
    finally:
        for name in unfinished.values():
            with contextlib.suppress(OSError):
                os.unlink(name)


def end_well_on_signals():
    """From now on a signal that asks the program to end does so like sys.exit(): what is unfinished is removed."""
    for number in (signal.SIGHUP, signal.SIGINT, signal.SIGTERM):
        if signal.getsignal(number) in (signal.SIG_DFL, signal.default_int_handler):  # one that is ignored stays so
            signal.signal(number, lambda number, _: sys.exit(128 + number))
