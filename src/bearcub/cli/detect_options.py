"""The options of ``bearcub detect``."""

import argparse
from pathlib import Path

from bearcub.cli.parsing import count, degrees, number
from bearcub.cli.rig_options import add_rig_options
from bearcub.stereo import Encoding

METHODS = ("bearcub", "classic", "classic-printed")


def configure(parser: argparse.ArgumentParser) -> None:
    """Add the command's arguments."""
    parser.add_argument(
        "left",
        nargs="?",
        type=Path,
        metavar="LEFT",
        help="left image, a folder of them, or a video; no input at all: the embedded sample",
    )
    parser.add_argument("right", nargs="?", type=Path, metavar="RIGHT", help="the right ones")
    _add_inputs(parser)
    _add_tilt(parser)
    add_rig_options(parser)
    _add_method(parser)
    _add_outputs(parser)


def _add_inputs(parser: argparse.ArgumentParser) -> None:
    group = parser.add_argument_group("input")
    group.add_argument(
        "--disparity",
        type=Path,
        metavar="FILE",
        help="a disparity or depth file, or a folder of them, instead of RIGHT",
    )
    group.add_argument(
        "--encoding",
        default=Encoding.AUTO.value,
        metavar="NAME",
        help=f"what its numbers mean: {', '.join(Encoding)}",
    )
    group.add_argument(
        "--byte-order", choices=("auto", "big", "little"), default="auto", help="of a 16-bit PGM"
    )
    group.add_argument(
        "--disparity-scale",
        type=number,
        default=1.0,
        metavar="N",
        help="stored units a pixel, for the encoding 'integer'",
    )
    group.add_argument(
        "--side-by-side", action="store_true", help="LEFT holds both: left half and right half"
    )
    group.add_argument(
        "--scale", type=number, default=1.0, metavar="S", help="shrink the input, such as 0.5"
    )
    group.add_argument("--limit", type=count, metavar="N", help="stop after N frames")


def _add_tilt(parser: argparse.ArgumentParser) -> None:
    group = parser.add_argument_group(
        "tilt", "the tilt sensor's reading of the body against gravity; 0 is level"
    )
    group.add_argument("--pitch", type=degrees, metavar="DEG", help="nose down > 0")
    group.add_argument("--roll", type=degrees, metavar="DEG", help="right side down > 0")
    group.add_argument(
        "--tilt-file", type=Path, metavar="CSV", help="a line 'pitch,roll' for every frame"
    )


def _add_method(parser: argparse.ArgumentParser) -> None:
    group = parser.add_argument_group("method")
    group.add_argument(
        "--method",
        choices=METHODS,
        default=METHODS[0],
        help="classic: the column analysis of 2005, as meant or as printed",
    )
    group.add_argument("--config", type=Path, metavar="TOML", help="see `bearcub config`")
    group.add_argument("--nearest", type=number, metavar="M", help="nearest range to match [m]")


def _add_outputs(parser: argparse.ArgumentParser) -> None:
    group = parser.add_argument_group("output")
    group.add_argument("--json", action="store_true", help="one JSON object a frame on stdout")
    group.add_argument(
        "--save",
        type=Path,
        metavar="PATH",
        help="annotated picture (.png .jpg), video (.mp4 .avi), or folder of pictures",
    )
    group.add_argument(
        "--figures", type=Path, metavar="DIR", help="the figures of the paper, of the first frame"
    )
