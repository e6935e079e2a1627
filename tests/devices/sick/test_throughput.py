"""What reading two LADARs at full speed costs; run it with ``pytest -m slow -s`` to see the number.

The scanners are emulated in processes of their own, so that the time of this process is the
drivers' alone: their reader threads, parsers and decoders.
"""

import contextlib
import subprocess
import sys
import time
from collections.abc import Iterator

import pytest

from bearcub.clock import MonotonicClock
from bearcub.devices.link import Link, SerialLink, TcpLink
from bearcub.devices.sick import Cola, Lms2xx, Sweep
from bearcub.devices.stream import Streaming
from bearcub.messages import Scan

WARM_UP, MEASURED = 4.0, 10.0  # seconds
BUDGET = 0.15  # of one core
FINE = Sweep(start_deg=-135, stop_deg=135, step_deg=0.25, scan_hz=50)  # 1081 beams


@contextlib.contextmanager
def emulated(kind: str, *line: str) -> Iterator[str]:
    """A scanner in a process of its own; gives where it can be reached."""
    program = "from bearcub.cli.main import run; run()"
    command = [sys.executable, "-c", program, "emulate", kind, *line]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as process:
        try:
            assert process.stdout is not None
            yield process.stdout.readline().split("\t")[0]
        finally:
            process.terminate()


def source(link: Link, driver: Lms2xx | Cola, rate_hz: float) -> Streaming[Scan]:
    return Streaming(link, driver, clock=MonotonicClock(), rate_hz=rate_hz, role="ladar")


@pytest.mark.slow
def test_two_ladars_at_full_speed_take_less_than_a_seventh_of_a_core() -> None:
    with emulated("lms2xx") as pty, emulated("cola", "--tcp", "0") as address:
        host, port = address.split(":")
        serial = source(SerialLink(pty), Lms2xx(baud=500000), 37.5)
        network = source(TcpLink(host, int(port)), Cola(sweep=FINE), 50.0)
        with serial, network:
            time.sleep(WARM_UP)
            before = [s.health().values for s in (serial, network)]
            cpu, wall = time.process_time(), time.perf_counter()
            time.sleep(MEASURED)
            cpu, wall = time.process_time() - cpu, time.perf_counter() - wall
            after = [s.health().values for s in (serial, network)]
            readings = serial.latest(), network.latest()
        rates = [(new - old) / wall for old, new in zip(before, after, strict=True)]
        print(  # noqa: T201 (what the test is run for)
            f"\n{100 * cpu / wall:.1f} % of one core at {rates[0]:.1f} and {rates[1]:.1f} scans/s"
        )
        assert [len(r.value) for r in readings if r] == [361, 1081]
        assert cpu < BUDGET * wall
        if rates != pytest.approx([37.5, 50.0], rel=0.1):
            pytest.skip(f"the machine is too busy for the emulated scanners: {rates} scans/s")
