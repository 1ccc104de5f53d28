"""What programs in Python do as those in C++ do: options, one line for an error, and exit codes."""
import argparse
import contextlib
import json
import os
import subprocess
import sys

from new_file import WriteError, end_well_on_signals, new_file, require_writable

end_well_on_signals()  # what a program imports after this takes longer than many a run
# Messages of a build whose setup.bash nobody has sourced.
sys.path.append(os.path.join(os.path.dirname(os.path.abspath(sys.argv[0])), "..", "python3", "dist-packages"))


class Error(Exception):
    """One line that names the file, the place in it, what is wrong there and the remedy; the program ends with 1."""


class UsageError(Error):
    """Of the command line; the program ends with 2."""


class Parser(argparse.ArgumentParser):
    """Of `usage`, "TOOL arguments [options]"; help goes through say()."""

    def __init__(self, usage, summary, examples):
        super().__init__(usage=f"rosrun pf_resampling {usage}", description=summary, allow_abbrev=False,
                         formatter_class=argparse.RawDescriptionHelpFormatter,
                         epilog="examples:\n" + "\n".join(f"  rosrun pf_resampling {example}" for example in examples))
        self.short_usage = usage

    def error(self, message):
        raise UsageError(f"{message}; usage: {self.short_usage} (--help says more)")

    def _print_message(self, message, file=None):
        say(message[0].upper() + message[1:])

    def configuration(self):
        for option, metavar in (("--config", "FILE"), ("--set", "NAME=VALUE")):
            self.add_argument(option, metavar=metavar, action="append", default=[], help="as that of run_bag; may be repeated")

    def topic(self, name, default, what):
        self.add_argument(f"--{name}", metavar="TOPIC", default=default, type=lambda text: f"/{text.lstrip('/')}", help=what)


def say(text):
    try:
        if sys.stdout is None:
            raise OSError
        sys.stdout.buffer.write(text.encode("utf-8", "surrogateescape"))  # the names of files as they are
        sys.stdout.flush()
    except OSError as error:
        sys.stdout = None  # Python would try again at its end
        raise Error("standard output cannot be written; is the disk full?") from error


def require_separate(written, read):
    """Raises Error if a file that is written is also read, or written twice, or cannot be; both are [(role, path or None)]."""
    known = [(role, path) for role, path in read if path]
    for role, path in written:
        if not path:
            continue
        for other, there in known:
            is_there = os.path.exists(path) and os.path.exists(there)
            if os.path.samefile(path, there) if is_there else os.path.abspath(path) == os.path.abspath(there):
                raise Error(f"{role} {path} is the same file as {other} {there}; give another name")
        known.append((role, path))
        require_writable(path)


def what_is_wrong(error):
    """In words; of what the operating system refuses, with the name of the file."""
    if isinstance(error, OSError) and error.filename:
        return f"{os.fsdecode(error.filename)}: {error.strerror}"
    return str(error) or type(error).__name__


@contextlib.contextmanager
def naming(path):
    """Whatever a file of the wrong kind leads to is an Error that names the file, or an option."""
    try:
        yield
    except (WriteError, UsageError):
        raise
    except Exception as error:
        what = what_is_wrong(error)
        raise Error(what if path in what or what.startswith("--") else f"{path}: {what}") from error


def output_of(tool, arguments, given=b"", shows_progress=True):
    """What another program prints of what it is given; raises Error with what it says if it cannot."""
    program = os.path.join(os.path.dirname(os.path.abspath(sys.argv[0])), tool)
    # On a terminal it may show how far it has come.
    child = subprocess.run([program, *map(str, arguments)], input=given, stdout=subprocess.PIPE, check=False,
                           stderr=None if shows_progress and sys.stderr and sys.stderr.isatty() else subprocess.PIPE)
    if child.returncode:
        said = (child.stderr or f"{tool}: failed, as it says".encode()).decode("utf-8", "surrogateescape").strip()
        raise (UsageError if child.returncode == 2 else Error)(said.replace(f"{tool}: ", "", 1))
    return child.stdout


def answer_of(tool, arguments, given=b"", shows_progress=True):
    """Likewise of one that prints JSON."""
    return json.loads(output_of(tool, arguments, given, shows_progress))


def require_picture(path):
    if os.path.splitext(path)[1] not in (".png", ".pdf", ".svg"):
        raise Error(f"{path}: a picture ends in .png, .pdf or .svg")


def draw(data, path):
    try:
        import plot_paths
    except ImportError as error:
        raise Error(f"{path}: not drawn: {error.name} is missing: sudo apt-get install python3-matplotlib") from None
    with new_file(path) as unfinished:
        plot_paths.draw(data).savefig(unfinished, dpi=130, format=os.path.splitext(path)[1][1:])


def run_tool(tool, body):
    """Runs `body` on the arguments, without those for ROS; returns the exit code, which `body` may return."""
    # If the caller has closed a standard stream, its number must not become that of a file.
    while os.open(os.devnull, os.O_RDONLY) <= 2:
        pass
    try:
        return body([word for word in sys.argv[1:] if not (word.startswith("__") and ":=" in word)]) or 0
    except (Error, WriteError, OSError) as error:
        line = "".join(" " if c in "\n\r\t" else c if c.isprintable() else "?" for c in what_is_wrong(error))
        print(f"{tool}: {line}", file=sys.stderr)
        return 2 if isinstance(error, UsageError) else 1
