"""How the command line is read: one-line errors, and numbers with their meaning.

Nothing here imports numpy or OpenCV before a value needs it, which keeps ``--help`` immediate.
"""

import argparse
import re
import sys
from typing import NoReturn

from bearcub.cli.codes import BAD_INPUT


class Parser(argparse.ArgumentParser):
    """Says what is wrong in one line, without the usage, and exits with 2."""

    def error(self, message: str) -> NoReturn:
        """Print `message` and exit."""
        sys.stderr.write(f"bearcub: error: {message} (see {self.prog} --help)\n")
        raise SystemExit(BAD_INPUT)


def degrees(text: str) -> float:
    """Return an angle in degrees; for argparse."""
    from bearcub.devices.tilt_csv import parse_degrees  # noqa: PLC0415 (numpy, see the module)

    try:
        return parse_degrees(text)
    except ValueError as error:
        raise argparse.ArgumentTypeError(str(error)) from None


def number(text: str) -> float:
    """Return a finite number; for argparse."""
    try:
        value = float(text)
    except ValueError:
        raise argparse.ArgumentTypeError(f"{text!r}: expected a number") from None
    if not abs(value) < float("inf"):
        raise argparse.ArgumentTypeError(f"{text!r}: expected a finite number")
    return value


def count(text: str) -> int:
    """Return a whole number of at least 1; for argparse."""
    if not text.isdecimal() or int(text) < 1:
        raise argparse.ArgumentTypeError(f"{text!r}: expected a whole number, 1 or more")
    return int(text)


def disparities(text: str) -> int:
    """Return a number of disparities to search, a multiple of 16; for argparse."""
    if count(text) % 16:
        raise argparse.ArgumentTypeError(f"{text!r}: expected a multiple of 16")
    return int(text)


def size(text: str) -> tuple[int, int]:
    """Return width and height of ``640x480``; for argparse."""
    found = re.fullmatch(r"(\d{1,5})x(\d{1,5})", text)
    if not found:
        raise argparse.ArgumentTypeError(f"{text!r}: expected WIDTHxHEIGHT such as 640x480")
    return int(found[1]), int(found[2])


def camera_numbers(text: str) -> tuple[int, int]:
    """Return the two camera numbers of ``2,3``; for argparse."""
    found = re.fullmatch(r"(\d{1,2}),(\d{1,2})", text)
    if not found:
        raise argparse.ArgumentTypeError(f"{text!r}: expected LEFT,RIGHT such as 2,3")
    return int(found[1]), int(found[2])
