"""``bearcub emulate``: a device made of software, on a pty or a TCP port."""

import argparse
import contextlib
import threading
from pathlib import Path

from bearcub.cli.parsing import number
from bearcub.clock import Clock, MonotonicClock
from bearcub.emulators import Emulator, PtyHost, TcpHost
from bearcub.emulators.faults import between
from bearcub.emulators.kinds import KINDS
from bearcub.errors import InputError


def configure(parser: argparse.ArgumentParser) -> None:
    """Add the command's arguments."""
    parser.add_argument(
        "kind",
        choices=KINDS,
        metavar="KIND",
        help="; ".join(f"{name}: {kind.purpose}" for name, kind in KINDS.items()),
    )
    line = parser.add_mutually_exclusive_group()
    line.add_argument("--pty", action="store_true", help="serve it on a pseudo-terminal")
    line.add_argument(
        "--tcp",
        type=_port,
        metavar="PORT",
        help="serve it on this port of 127.0.0.1; 0: a free one",
    )
    parser.add_argument(
        "--link", type=Path, metavar="PATH", help="make a symbolic link to the pseudo-terminal"
    )
    parser.add_argument("--fault", metavar="NAME", help="something that goes wrong; see --faults")
    parser.add_argument(
        "--after", type=number, default=0.0, metavar="S", help="seconds until the fault begins (0)"
    )
    parser.add_argument(
        "--lasting", type=number, metavar="S", help="seconds until it is over (for ever)"
    )
    parser.add_argument("--faults", action="store_true", help="list the faults of KIND and leave")
    parser.add_argument(
        "--seconds", type=number, metavar="S", help="leave after that time (at Ctrl-C)"
    )


def execute(args: argparse.Namespace) -> int:
    """Serve the device until Ctrl-C."""
    kind = KINDS[args.kind]
    if args.faults:
        print(" ".join(kind.all_faults))
        return 0
    clock = MonotonicClock()
    emulator = _with_fault(args, clock)
    on_pty = args.pty or (args.tcp is None and kind.tcp_port is None)
    if args.link and not on_pty:
        raise InputError(f"--link {args.link}: expected a pseudo-terminal (--pty), not a TCP port")
    host: PtyHost | TcpHost
    if on_pty:
        host = PtyHost(emulator, clock=clock, link=args.link)
        where = host.path
    else:
        host = TcpHost(emulator, clock=clock, port=args.tcp or 0)
        where = f"127.0.0.1:{host.port}"
    with host, contextlib.suppress(KeyboardInterrupt):  # this is how it is ended
        print(f"{where}\t{args.kind}: {kind.purpose}; Ctrl-C ends it", flush=True)
        threading.Event().wait(args.seconds)
    return 0


def _with_fault(args: argparse.Namespace, clock: Clock) -> Emulator:
    kind = KINDS[args.kind]
    emulator = kind.emulator()
    if args.fault is None:
        return emulator
    if args.fault not in kind.all_faults:
        known = ", ".join(kind.all_faults)
        raise InputError(f"--fault {args.fault}: {args.kind} has {known}")
    start_ns = clock.now_ns() + round(args.after * 1e9)
    lasting_s = 1e9 if args.lasting is None else args.lasting  # thirty years
    return kind.all_faults[args.fault](
        emulator, between(start_ns, start_ns + round(lasting_s * 1e9))
    )


def _port(text: str) -> int:
    if not text.isdecimal() or int(text) > 65535:
        raise argparse.ArgumentTypeError(f"{text!r}: expected a port from 0 to 65535")
    return int(text)
