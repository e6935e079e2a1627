"""``bearcub devices``: what is plugged in, and what software is there to use it."""

import argparse
import json
from dataclasses import asdict

from bearcub.runtime.inventory import Plugged, cameras, serial_ports, software


def configure(parser: argparse.ArgumentParser) -> None:
    """Add the command's arguments."""
    parser.add_argument("--json", action="store_true", help="one JSON object on stdout")


def execute(args: argparse.Namespace) -> int:
    """List cameras and serial ports."""
    seen, ports = cameras(), serial_ports()
    if args.json:
        found = {
            "schema": "bearcub.devices/1",
            "cameras": [asdict(camera) for camera in seen],
            "serial_ports": None if ports is None else [asdict(port) for port in ports],
            "software": [asdict(part) for part in software()],
        }
        print(json.dumps(found))
        return 0
    _print("cameras", seen)
    if ports is None:
        print(
            "serial ports: cannot be listed without pyserial; run: pip install 'bearcub[devices]'"
        )
    else:
        _print("serial ports", ports)
    return 0


def _print(title: str, found: list[Plugged]) -> None:
    print(f"{title}:" if found else f"{title}: none")
    for device in found:
        name = f"  {device.name}" if device.name else ""
        print(f"  {device.path}{name}")
        if device.lasting:
            print(f"    {device.lasting}")
