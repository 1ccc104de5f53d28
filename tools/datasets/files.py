"""Reads text files of numbers, and MATLAB files."""
import math
import warnings

import numpy as np
from command_line import Error, naming


def lines_of(path):
    """The lines of a text file, without a byte order mark."""
    with open(path, encoding="utf-8-sig", errors="replace") as file:
        return file.read().split("\n")


def finite_number(word, place):
    try:
        number = float(word)
    except ValueError:
        number = math.nan
    if not math.isfinite(number):
        raise Error(f"{place}'{word}' is not a finite number")
    return number


def number_table(path, columns):
    """The rows of a text file, of at least `columns` finite numbers each. What follows # or % is passed over."""
    with naming(path), warnings.catch_warnings():
        warnings.simplefilter("error", UserWarning)  # of a file with nothing in it
        rows = np.loadtxt(path, comments=["#", "%"], ndmin=2)
    if rows.shape[1] < columns:
        raise Error(f"{path}: has {rows.shape[1]} columns, {columns} are needed")
    if not np.isfinite(rows).all():
        raise Error(f"{path}: row {1 + np.argmin(np.isfinite(rows).all(axis=1))} is not finite")
    return rows


class MatFile:
    """A MATLAB file of versions 5 to 7."""

    def __init__(self, path):
        import scipy.io  # which takes a third of a second
        self.path = path
        with open(path, "rb") as file:
            try:
                self.variables = scipy.io.loadmat(file)
            except Exception as error:  # of many types, as bytes have it
                raise Error(f"{path}: is damaged, or not a MATLAB file of versions 5 to 7: save it with -v7 ({error})") from error

    def names(self):
        return ", ".join(name for name in self.variables if not name.startswith("__")) or "nothing"

    def matrix(self, name, columns):
        """The matrix of that name as rows of at least `columns` floats; None if it is not there."""
        value = self.variables.get(name)
        if value is not None and len(value) and value.shape[1] < columns:
            raise Error(f"{self.path}: variable {name} has {value.shape[1]} columns, {columns} are needed")
        return None if value is None else value.astype(float).tolist()
