"""``bearcub doctor``: every device of the robot in turn, and what to do about what is wrong."""

import argparse
import json
import logging
import math
import sys
from pathlib import Path
from typing import Any

from bearcub.cli.parsing import number
from bearcub.clock import MonotonicClock
from bearcub.config import Config
from bearcub.runtime.devices import Robot, load_robot
from bearcub.runtime.doctor import Checkup, Doctor, Patience, processor_remark
from bearcub.runtime.inventory import Software, software
from bearcub.runtime.verdict import Grade, Remark

_FAULT_FOUND = 1
_MARKS = {Grade.GOOD: "good", Grade.WARNING: "look at this", Grade.FAULT: "FAULT"}


def configure(parser: argparse.ArgumentParser) -> None:
    """Add the command's arguments."""
    parser.add_argument(
        "config",
        type=Path,
        nargs="?",
        metavar="CONFIG",
        help="TOML file with [devices.NAME] tables; without it only this computer is examined",
    )
    parser.add_argument(
        "--signs",
        action="store_true",
        help="ask to move the robot, and check the signs of tilt and wheels",
    )
    parser.add_argument(
        "--seconds", type=number, default=2.0, metavar="S", help="to look at each device (2)"
    )
    parser.add_argument(
        "--patience", type=number, default=10.0, metavar="S", help="for its first value (10)"
    )
    parser.add_argument("--no-bench", action="store_true", help="leave out how long a frame takes")
    parser.add_argument("--json", action="store_true", help="one JSON object on stdout")


def execute(args: argparse.Namespace) -> int:
    """Examine everything; 0 when there is no fault, else 1."""
    # What goes wrong is in the report; the log would say it a second time.
    logging.getLogger("bearcub").addHandler(logging.NullHandler())
    clock = MonotonicClock()
    robot = (
        Robot(config=Config(), devices=[])
        if args.config is None
        else load_robot(args.config, clock=clock)
    )
    doctor = Doctor(
        clock=clock,
        patience=Patience(first=args.patience, look=args.seconds),
        config=robot.config,
    )
    checkups = []
    for device in robot.devices:
        checkup = doctor.examine(device, ask=_ask if args.signs else None)
        checkups.append(checkup)
        if not args.json:
            _print_device(checkup)
    computer = [] if args.no_bench else [processor_remark()]
    parts = software()
    if args.json:
        print(json.dumps(_report(checkups, computer, parts), allow_nan=False))
    else:
        _print_computer(computer, parts)
    worst = max((checkup.grade for checkup in checkups), default=Grade.GOOD)
    return _FAULT_FOUND if worst is Grade.FAULT else 0


def _ask(request: str) -> None:
    print(f"  now {request}, and hold it", file=sys.stderr, flush=True)


def _print_device(checkup: Checkup) -> None:
    health = checkup.health
    print(f"{checkup.name}, {checkup.kind}: {_MARKS[checkup.grade]}")
    if health.values:
        print(f"  {health.rate_hz:.1f} a second, {checkup.age * 1e3:.0f} ms old")
    for remark in checkup.remarks:
        _print_remark(remark)


def _print_remark(remark: Remark) -> None:
    print(f"  {remark.text}")
    if remark.advice:
        print(f"    -> {remark.advice}", flush=True)


def _print_computer(computer: list[Remark], parts: list[Software]) -> None:
    print("this computer:")
    for remark in computer:
        _print_remark(remark)
    for part in parts:
        print(f"  {part.name}: {'there' if part.found else f'not there; {part.advice}'}")


def _report(
    checkups: list[Checkup], computer: list[Remark], parts: list[Software]
) -> dict[str, Any]:
    return {
        "schema": "bearcub.doctor/1",
        "devices": [
            {
                "name": checkup.name,
                "kind": checkup.kind,
                "grade": checkup.grade.name.lower(),
                "rate_hz": _known(checkup.health.rate_hz),
                "age_ms": _known(checkup.age * 1e3),
                "values": checkup.health.values,
                "errors": checkup.health.errors,
                "drops": checkup.health.drops,
                "remarks": [_remark(remark) for remark in checkup.remarks],
            }
            for checkup in checkups
        ],
        "computer": [_remark(remark) for remark in computer],
        "software": {part.name: part.found for part in parts},
    }


def _remark(remark: Remark) -> dict[str, str]:
    return {"text": remark.text, "grade": remark.grade.name.lower(), "advice": remark.advice}


def _known(value: float) -> float | None:
    return round(value, 3) if math.isfinite(value) else None
