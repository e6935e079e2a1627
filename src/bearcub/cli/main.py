"""The ``bearcub`` command: reads the command line, runs one command, reports one-line errors."""

import argparse
import contextlib
import importlib
import os
import sys
from collections.abc import Sequence
from importlib.metadata import version
from typing import NoReturn

from bearcub.cli.codes import BAD_INPUT, INTERRUPTED, NOBODY_READS
from bearcub.cli.parsing import Parser
from bearcub.errors import BearcubError

COMMANDS = {
    "detect": "answer the six questions for images, videos or disparity maps",
    "config": "print the configuration, with the meaning of every number",
    "bench": "measure how long the stages take",
    "simulate": "render worlds with truth, and write them as files",
    "evaluate": "score answers against real recordings or rendered scenes",
    "emulate": "serve a device made of software on a pseudo-terminal or a TCP port",
    "devices": "list what is plugged in: cameras and serial ports",
    "doctor": "look at every device of the robot in turn, and say what to do",
}
"""Modules of this package, each with ``configure(parser)`` and ``execute(args) -> int``."""


class _ShowVersion(argparse.Action):
    """Prints the version, which is only looked up when asked for."""

    def __call__(self, *_: object, **__: object) -> NoReturn:
        print(f"bearcub {version('bearcub')}")
        raise SystemExit(0)


def build_parser(argv: Sequence[str]) -> argparse.ArgumentParser:
    """Return the parser of the command line; only a command in `argv` is imported."""
    parser = Parser(
        prog="bearcub",
        description="Stereo obstacle perception for ground robots, on a CPU. "
        "`bearcub detect` without more looks at the embedded sample.",
    )
    parser.add_argument("--version", action=_ShowVersion, nargs=0, help="print the version")
    commands = parser.add_subparsers(
        title="commands", metavar="COMMAND", required=True, parser_class=Parser
    )
    for name, purpose in COMMANDS.items():
        part = commands.add_parser(name, help=purpose, description=f"{purpose.capitalize()}.")
        if name in argv:
            command = importlib.import_module(f"bearcub.cli.{name}")
            command.configure(part)
            part.set_defaults(execute=command.execute)
    return parser


def main(argv: Sequence[str] | None = None) -> int:
    """Run one command line and return its exit code.

    Parameters
    ----------
    argv : sequence of str, optional
        Without the program's name; by default the process's own.

    Returns
    -------
    int
        0; 2 for bad input or arguments, after one line on stderr; 130 after Ctrl-C.
    """
    given = sys.argv[1:] if argv is None else argv
    try:
        args = build_parser(given).parse_args(given)
        return int(args.execute(args))
    except SystemExit as leaving:  # argparse, after --help or an error it has printed
        return int(leaving.code or 0)
    except BearcubError as error:
        print(f"bearcub: error: {' '.join(str(error).split())}", file=sys.stderr)
        return BAD_INPUT
    except KeyboardInterrupt:
        print("bearcub: interrupted", file=sys.stderr)
        return INTERRUPTED


def run() -> NoReturn:
    """Run the process's command line and exit; a reader that went away is no error."""
    for stream in (sys.stdout, sys.stderr):
        with contextlib.suppress(AttributeError):  # replaced by something that is no text file
            stream.reconfigure(errors="replace")  # type: ignore[union-attr]
    try:
        code = main()
        sys.stdout.flush()
    except BrokenPipeError:
        # Python flushes stdout once more at its end; it must not find the broken pipe again.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        code = NOBODY_READS
    sys.exit(code)
