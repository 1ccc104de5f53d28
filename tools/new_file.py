"""Writes files so that each is whole or as it was: beside it first, then under its name."""
import contextlib
import os
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
    if not os.path.lexists(path):
        return
    if not is_regular_file(path):
        raise WriteError(f"{path} cannot be written: it is not a regular file; remove or rename it")
    if not os.lstat(path).st_mode & 0o222:  # root could write it all the same
        raise WriteError(f"{path} cannot be written: it is read-only; make it writable or rename it")


@contextlib.contextmanager
def new_file(path):
    """The name of a file to write, which takes the place of `path` when all went well, and is removed otherwise. Raises
    WriteError if it cannot be written."""
    unfinished = f"{path}.part-{os.getpid()}"
    try:
        require_writable(path)
        with open(unfinished, "wb") as file:
            if os.path.exists(path):
                os.fchmod(file.fileno(), os.lstat(path).st_mode & 0o777)
        yield unfinished
        with open(unfinished, "rb") as file:
            os.fsync(file.fileno())
        require_writable(path)  # what is there now
        os.replace(unfinished, path)
    except OSError as error:
        raise WriteError(f"{path} cannot be written: {error.strerror}; {REMEDY}") from error
    finally:
        with contextlib.suppress(OSError):
            os.unlink(unfinished)


def write_files(contents):
    """Writes {path: bytes}. If one of them cannot be written, none is: raises WriteError, and leaves no trace."""
    with contextlib.ExitStack() as files:
        for path, data in contents.items():
            with open(files.enter_context(new_file(path)), "wb") as file:
                file.write(data)


def end_well_on_signals():
    """From now on a signal that asks the program to end does so like sys.exit(): what is unfinished is removed."""
    for number in (signal.SIGHUP, signal.SIGINT, signal.SIGTERM):
        if signal.getsignal(number) in (signal.SIG_DFL, signal.default_int_handler):  # one that is ignored stays so
            signal.signal(number, lambda number, _: sys.exit(128 + number))
