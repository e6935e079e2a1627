"""The options that say which camera took the pictures and where it sits."""

import argparse
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from bearcub.cli.parsing import camera_numbers, degrees, number

if TYPE_CHECKING:
    from bearcub.rig import Rig


def add_rig_options(parser: argparse.ArgumentParser) -> None:
    """Add the options of the rig and its mount."""
    group = parser.add_argument_group(
        "rig", "the calibration, and where the left camera sits on the body (overrides the file's)"
    )
    group.add_argument(
        "--rig",
        type=Path,
        metavar="FILE",
        help="rig TOML, KITTI or Middlebury calib.txt, ROS camera_info YAML, OpenCV "
        "stereoRectify YAML or Kalibr camchain.yaml, or a folder that holds one",
    )
    group.add_argument(
        "--rig-right",
        "--right",
        type=Path,
        metavar="FILE",
        help="the right camera's file of a ROS pair, or OpenCV's extrinsics",
    )
    group.add_argument(
        "--cameras",
        type=camera_numbers,
        metavar="L,R",
        help="which two of a file with more cameras",
    )
    group.add_argument(
        "--unit", type=number, metavar="M", help="metres per unit of length in the file"
    )
    group.add_argument(
        "--rectified", action="store_true", help="the pictures are rectified already"
    )
    _add_mount_options(group)


def _add_mount_options(group: "argparse._ArgumentGroup") -> None:
    group.add_argument("--height", type=number, metavar="M", help="camera above the ground [m]")
    group.add_argument(
        "--mount-pitch", type=degrees, metavar="DEG", help="camera against the body, nose down > 0"
    )
    group.add_argument(
        "--mount-roll", type=degrees, metavar="DEG", help="the same, right side down > 0"
    )
    group.add_argument("--x", type=number, metavar="M", help="camera ahead of base_link [m]")
    group.add_argument("--y", type=number, metavar="M", help="camera left of base_link [m]")
    group.add_argument("--baseline", type=number, metavar="M", help="between the cameras [m]")


def load_rig(args: argparse.Namespace, path: Path) -> "Rig":
    """Return the rig in `path` with what the options override.

    Raises
    ------
    BearcubError
        If it cannot be read, or a number cannot be right.
    """
    from bearcub.rig import Rig  # noqa: PLC0415 (numpy, kept out of --help)

    rig = Rig.load(
        path,
        right=args.rig_right,
        height=args.height,
        pitch_deg=args.mount_pitch,
        roll_deg=args.mount_roll,
        x=args.x,
        y=args.y,
        unit=args.unit,
        cameras=args.cameras,
        rectified=args.rectified,
    )
    if args.baseline is not None:
        rig = replace(rig, camera=replace(rig.camera, baseline=args.baseline))
        rig.check()
    return rig
