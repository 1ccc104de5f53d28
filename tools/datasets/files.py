"""Reads text files of numbers, and MATLAB files."""
import math
import os
import re
import warnings

from command_line import Error


def require_directory(path, what):
    if not os.path.exists(path):
        raise Error(f"{path}: no such directory")
    if not os.path.isdir(path):
        raise Error(f"{path}: is a file; give the directory with {what}")


def require_file(path):
    if not os.path.exists(path):
        raise Error(f"{path}: no such file")
    if os.path.isdir(path):
        raise Error(f"{path}: is a directory, not a file")


def lines_of(path):
    """The lines of a text file, without a byte order mark."""
    require_file(path)
    try:
        with open(path, encoding="utf-8-sig", errors="replace", newline="\n") as file:
            return file.read().split("\n")
    except OSError as error:
        raise Error(f"{path}: cannot be read: {error.strerror}") from error


def number_of(word):
    """None of what is no number (or one that only Python takes)."""
    try:
        return None if "_" in word else float(word)
    except ValueError:
        return None


def finite_number(word, place):
    number = number_of(word)
    if number is None or not math.isfinite(number):
        raise Error(f"{place}'{word}' is not a finite number")
    return number


class NumberTable:
    """A text file of numbers, a row per line, spaces, tabs or commas between. Blank lines and what follows # or % are
    passed over. Each row has at least `columns` finite numbers. Errors name the file and the line."""

    def __init__(self, path, columns):
        self.path, self.lines, self.rows = path, [], []
        for line, text in enumerate(lines_of(path), 1):
            words = re.split("[#%]", text, maxsplit=1)[0].replace(",", " ").split()
            row = [finite_number(word, f"{path}:{line}: ") for word in words]
            if words and len(row) < columns:
                raise Error(f"{path}:{line}: {len(row)} numbers, {columns} are needed")
            if words:
                self.lines.append(line)
                self.rows.append(row)

    def error(self, row, what):
        return Error(f"{self.path}:{self.lines[row]}: {what}")

    def whole_number(self, row, column):
        """Of 32 bits."""
        value = self.rows[row][column]
        if not value.is_integer() or abs(value) >= 2**31:
            raise self.error(row, f"{value:f} is not a whole number")
        return int(value)

    def sort_by_time(self):
        """Puts rows in order of their first column, those of equal times as they were. Returns whether they were in another."""
        order = sorted(range(len(self.rows)), key=lambda row: self.rows[row][0])
        self.lines, self.rows = [self.lines[row] for row in order], [self.rows[row] for row in order]
        return order != list(range(len(order)))


class MatFile:
    """A MATLAB file of versions 5 to 7."""

    def __init__(self, path):
        require_file(path)
        self.path = path
        with open(path, "rb") as file:
            self.is_one = file.read(10).startswith(b"MATLAB 5.0")
        if not self.is_one:
            raise Error(f"{path}: is not a MATLAB file of versions 5 to 7 (save it with -v7)")

    def read(self, function, *arguments, **named):
        try:
            import scipy.io
        except ImportError as error:
            raise Error(f"{self.path}: reading MATLAB files needs {error.name}: sudo apt-get install python3-scipy") from error
        try:
            with warnings.catch_warnings():
                warnings.simplefilter("ignore")
                return getattr(scipy.io, function)(self.path, *arguments, **named)
        except Exception as error:  # of many types, as bytes have it
            raise Error(f"{self.path}: is truncated or damaged ({type(error).__name__}: {error})") from error

    def names(self):
        names = [name or "one without a name" for name, _, _ in self.read("whosmat")]
        return ", ".join(names[:20] + ["..."] * (len(names) > 20)) or "nothing"

    def matrix(self, name, columns):
        """The real matrix of that name as rows of at least `columns` floats; None if it is not there."""
        value = self.read("loadmat", variable_names=[name]).get(name)
        if value is None:
            return None
        place = f"{self.path}: variable {name}"
        if getattr(getattr(value, "dtype", None), "kind", "") not in tuple("fiu") or not hasattr(value, "tolist"):
            raise Error(f"{place} is not a real matrix of numbers")
        if value.ndim != 2:
            raise Error(f"{place} is not a matrix: it has {value.ndim} dimensions")
        if len(value) and value.shape[1] < columns:
            raise Error(f"{place} has {value.shape[1]} columns, {columns} are needed")
        return value.astype(float).tolist()
