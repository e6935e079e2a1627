"""VectorNav VN-100 and its family: ``$VNYMR`` sentences, 115200 baud.

Yaw, pitch and roll in degrees, magnetic field, acceleration [m/s²] and angular rate [rad/s]; axes
x ahead, y right, z down. Register 6 chooses the sentence (14 is ``VNYMR``), register 7 its rate.
"""

import math

from bearcub.devices.driver import Ask, Conversation, Measured, on_the_line
from bearcub.devices.nmea import Sentence, encode, sentences
from bearcub.devices.tilt.angles import AIRCRAFT, Convention, tilt_from
from bearcub.errors import DeviceError, DeviceTimeout, FormatError
from bearcub.messages import Inertial, Tilt

BAUD = 115200
RATES = (1, 2, 4, 5, 10, 20, 25, 40, 50, 100, 200)  # that register 7 takes [Hz]

_TIMEOUT = 0.3
_TRIES = 4
_ERRORS = {
    "01": "hard fault",
    "02": "input buffer overflow",
    "03": "invalid checksum",
    "04": "invalid command",
    "05": "not enough parameters",
    "06": "too many parameters",
    "07": "invalid parameter",
    "08": "invalid register",
    "09": "unauthorised access",
    "0A": "watchdog reset",
    "0B": "output buffer overflow",
    "0C": "baud rate too low for the data",
}


class _VectorNav:
    """What the driver of its angles and that of its raw values have in common."""

    def __init__(self, *, rate_hz: int = 40, baud: int = BAUD) -> None:
        if rate_hz not in RATES:
            known = ", ".join(str(rate) for rate in RATES)
            raise DeviceError(f"rate_hz = {rate_hz}: a VectorNav takes one of {known}")
        self.parser = sentences()
        self._rate_hz = rate_hz
        self._baud = baud

    def conversation(self) -> Conversation[Sentence]:
        """Choose sentence and rate; both are forgotten when it is switched off."""
        yield from _write("06,14")
        yield from _write(f"07,{self._rate_hz}")

    def farewell(self) -> bytes:
        """Return nothing: it may go on sending."""
        return b""

    def _numbers(self, telegram: Sentence) -> list[float]:
        if len(telegram.fields) != 12:
            raise FormatError(f"{telegram}: {len(telegram.fields)} fields, expected 12")
        return [telegram.number(text) for text in telegram.fields]

    def _latency(self, telegram: Sentence) -> float:
        return on_the_line(len(str(telegram)) + 5, self._baud)


class VectorNav(_VectorNav):
    """The driver of a VectorNav's own attitude.

    Parameters
    ----------
    rate_hz : int
        One of `RATES`.
    baud : int
        Of the line, for the latency.
    convention : Convention
        Of its signs.
    """

    def __init__(
        self, *, rate_hz: int = 40, baud: int = BAUD, convention: Convention = AIRCRAFT
    ) -> None:
        super().__init__(rate_hz=rate_hz, baud=baud)
        self._convention = convention

    def value(self, telegram: Sentence) -> Measured[Tilt] | None:
        """Return its attitude."""
        if telegram.name != "VNYMR":
            return None
        yaw, pitch, roll = (math.radians(value) for value in self._numbers(telegram)[:3])
        tilt = tilt_from(self._convention, pitch=pitch, roll=roll, heading=yaw)
        return Measured(tilt, self._latency(telegram))


class VectorNavInertial(_VectorNav):
    """The driver of a VectorNav's raw accelerations and rates, for `complementary.Fused`.

    Parameters
    ----------
    rate_hz : int
        One of `RATES`.
    baud : int
        Of the line, for the latency.
    """

    def value(self, telegram: Sentence) -> Measured[Inertial] | None:
        """Return accelerations and rates in ``base_link`` axes."""
        if telegram.name != "VNYMR":
            return None
        ax, ay, az, p, q, r = self._numbers(telegram)[6:]
        inertial = Inertial(acceleration=(ax, -ay, -az), rate=(p, -q, -r))
        return Measured(inertial, self._latency(telegram))


def _write(register: str) -> Conversation[Sentence]:
    """Write a register, several times if need be."""
    for _ in range(_TRIES):
        reply = yield Ask(
            encode(f"VNWRG,{register}"), lambda reply: reply.name in ("VNWRG", "VNERR"), _TIMEOUT
        )
        if reply is not None and reply.name == "VNWRG":
            return
        if reply is not None and reply.fields[:1] != ("03",):  # else it was garbled on its way
            code = "".join(reply.fields[:1])
            raise DeviceError(
                f"refuses register {register} with error {code}: {_ERRORS.get(code, 'unknown')}"
            )
    raise DeviceTimeout(f"no reply to register {register}; check power, cable and baud")
