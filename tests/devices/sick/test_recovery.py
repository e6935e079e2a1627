"""Whenever a fault ends and whatever the driver then does, scans are back within two seconds."""

from collections.abc import Callable

import pytest

from bearcub.clock import ManualClock
from bearcub.devices.driver import Driver
from bearcub.devices.sick import Cola, Lms2xx
from bearcub.devices.stream import Streaming
from bearcub.emulators import DirectLink, Emulator
from bearcub.emulators.cola import ColaEmulator
from bearcub.emulators.faults import between
from bearcub.emulators.kinds import KINDS
from bearcub.emulators.lms2xx import Lms2xxEmulator
from bearcub.messages import Scan

BACK_WITHIN = 2.0
START = 3.0
LASTING = [0.15, 1.0, 1.85, 2.7]


def time_to_recover(
    fault: str, lasting: float, emulator: Emulator, driver: Driver[object, Scan], rate_hz: float
) -> float:
    """From the fault's end to a scan that was measured after it [s]."""
    kind = KINDS["lms2xx" if isinstance(emulator, Lms2xxEmulator) else "cola"]
    clock = ManualClock()
    end_ns = round((START + lasting) * 1e9)
    faulty = kind.all_faults[fault](emulator, between(round(START * 1e9), end_ns))
    link = DirectLink(faulty, clock=clock, wait=clock.advance)
    source = Streaming(link, driver, clock=clock, rate_hz=rate_hz, role="ladar")
    while clock.now_ns() < end_ns + 10e9:
        clock.advance(source.step() or 1e-6)
        reading = source.latest()
        if reading and reading.stamp_ns >= end_ns:
            break
    return (clock.now_ns() - end_ns) * 1e-9


@pytest.mark.parametrize("fault", KINDS["lms2xx"].all_faults)
@pytest.mark.parametrize("baud", [38400, 500000])
def test_an_lms2xx_is_back_whenever_the_fault_ends(fault: str, baud: int) -> None:
    if (fault, baud) == ("split", 500000):
        pytest.skip("the fault lets fewer bytes through than the scanner sends")
    make: Callable[[], Lms2xx] = lambda: Lms2xx(baud=baud)  # noqa: E731
    rate_hz = make().rate_hz
    times = [
        time_to_recover(fault, lasting, Lms2xxEmulator(), make(), rate_hz)  # type: ignore[arg-type]
        for lasting in LASTING
    ]
    # A restart begins with the fault, not at its end: a short one is over before the scanner boots.
    booting = 0.4 if fault == "restart" else 0.0
    assert max(times) <= BACK_WITHIN + booting


@pytest.mark.parametrize("fault", [f for f in KINDS["cola"].all_faults if f != "split"])
def test_a_cola_scanner_is_back_whenever_the_fault_ends(fault: str) -> None:
    times = [
        time_to_recover(fault, lasting, ColaEmulator(), Cola(), 15.0)  # type: ignore[arg-type]
        for lasting in LASTING
    ]
    assert max(times) <= BACK_WITHIN
