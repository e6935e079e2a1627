"""GPS receivers: NMEA 0183 sentences on a serial line, and gpsd's JSON over TCP.

A position never travels without what it is worth: quality of the fix and HDOP are in the same
value, and a receiver that has lost its fix delivers values that say so. Courses, clockwise from
north on the wire, are counter-clockwise from east afterwards (REP-103).
"""

import calendar
import json
import math
import re
from functools import cache
from importlib import import_module
from typing import Any

from bearcub.devices import nmea
from bearcub.devices.driver import Ask, Conversation, Listening, Measured
from bearcub.devices.framing import Cut, Framer
from bearcub.errors import DeviceError, DeviceTimeout, FormatError
from bearcub.messages import Fix, FixQuality

_KNOT = 1852 / 3600  # m/s
_LONGEST_REPORT = 16384  # bytes; gpsd lists the satellites of all systems in one line
_NOT_JSON = "no JSON object"
_POSITIONS = ("GGA", "RMC")
_MODES = {  # RMC's mode indicator (NMEA 2.3), where there is no GGA to tell
    "A": FixQuality.GPS,
    "D": FixQuality.DGPS,
    "P": FixQuality.PPS,
    "R": FixQuality.RTK_FIXED,
    "F": FixQuality.RTK_FLOAT,
    "E": FixQuality.DEAD_RECKONING,
}
_STATUSES = {  # gpsd's TPV.status
    2: FixQuality.DGPS,
    3: FixQuality.RTK_FIXED,
    4: FixQuality.RTK_FLOAT,
    5: FixQuality.DEAD_RECKONING,
    6: FixQuality.DEAD_RECKONING,
    9: FixQuality.PPS,
}


def from_compass(course_deg: float) -> float:
    """Return a course, clockwise from north [deg], as an angle counter-clockwise from east [rad].

    Examples
    --------
    >>> [round(math.degrees(from_compass(course))) for course in (0, 90, 180, 270)]
    [90, 0, -90, -180]
    """
    return math.remainder(math.radians(90.0 - course_deg), 2 * math.pi)


class NmeaGps(Listening):
    """The sentences GGA, RMC, VTG and GST of one epoch as one `Fix`, from any talker.

    The fix is complete, and delivered, with the sentence that came last in the epoch before: GGA
    or RMC, whichever the receiver sends later. A receiver that sends only one of them needs no
    other.

    Parameters
    ----------
    latency : float
        From the moment a fix is for until its last byte arrives [s], as the receiver states it.

    Raises
    ------
    DeviceError
        If pynmeagps is missing, with the command that installs it.
    """

    def __init__(self, *, latency: float = 0.0) -> None:
        _pynmeagps()
        self.parser = nmea.lines()
        self._latency = latency
        self._closing = "GGA"
        self._last = ""
        self._time: object = None
        self._found: dict[str, Any] = {}

    def value(self, telegram: str) -> Measured[Fix] | None:
        """Return the fix that a sentence completes.

        Raises
        ------
        FormatError
            If a sentence with a right checksum holds what cannot be.
        """
        kind = telegram[2:5]
        if telegram.startswith("P") or kind not in (*_POSITIONS, "VTG", "GST"):
            return None
        sentence = _parse(telegram)
        if kind in _POSITIONS and sentence.time != self._time:
            self._closing = self._last or self._closing
            self._time, self._found = sentence.time, {}
        _READERS[kind](sentence, self._found)
        if kind not in _POSITIONS:
            return None
        self._last = kind
        return Measured(_fix(self._found), self._latency) if kind == self._closing else None


@cache
def _pynmeagps() -> Any:
    """Return the module, of the extra ``devices``: only a GPS that speaks NMEA needs it."""
    try:
        return import_module("pynmeagps")
    except ModuleNotFoundError:
        raise DeviceError(
            "a GPS on a line needs pynmeagps; run: pip install 'bearcub[devices]'"
        ) from None


def _parse(telegram: str) -> Any:
    library = _pynmeagps()
    wrong = (
        library.NMEAParseError,
        library.NMEAMessageError,
        library.NMEAStreamError,
        library.NMEATypeError,
    )
    try:
        sentence = library.NMEAReader.parse(nmea.encode(telegram))
    except wrong as error:
        raise FormatError(f"GPS: ${telegram}: {error}") from error
    if sentence is None or not hasattr(sentence, _LAST_FIELD[telegram[2:5]]):
        raise FormatError(f"GPS: ${telegram}: has too few fields")
    return sentence


_LAST_FIELD = {"GGA": "alt", "RMC": "date", "VTG": "sogk", "GST": "stdLong"}


def _read_gga(sentence: Any, found: dict[str, Any]) -> None:
    quality = sentence.quality
    if quality not in range(9):
        raise FormatError(f"GPS: GGA with quality {quality}: expected 0 to 8")
    # 7 and 8 are positions typed in and simulated: no satellite has measured them.
    found["quality"] = FixQuality(quality) if quality <= 6 else FixQuality.NONE
    found["satellites"] = sentence.numSV if isinstance(sentence.numSV, int) else None
    found["hdop"] = _number(sentence.HDOP, "HDOP")
    found["altitude"] = _number(sentence.alt, "altitude")
    _read_position(sentence, found, valid=quality > 0)


def _read_rmc(sentence: Any, found: dict[str, Any]) -> None:
    valid = sentence.status == "A"
    mode = str(getattr(sentence, "posMode", "") or "A")
    found.setdefault("quality", _MODES.get(mode, FixQuality.NONE) if valid else FixQuality.NONE)
    if valid:
        found["speed"] = _number(sentence.spd, "speed") * _KNOT
        found["course"] = from_compass(_number(sentence.cog, "course"))
    if sentence.date and sentence.time:
        at = sentence.time
        midnight = calendar.timegm((*sentence.date.timetuple()[:3], 0, 0, 0))
        seconds = midnight + at.hour * 3600 + at.minute * 60 + at.second
        found["utc_ns"] = seconds * 1_000_000_000 + at.microsecond * 1000
    _read_position(sentence, found, valid=valid)


def _read_vtg(sentence: Any, found: dict[str, Any]) -> None:
    found.setdefault("speed", _number(sentence.sogk, "speed") / 3.6)
    found.setdefault("course", from_compass(_number(sentence.cogt, "course")))


def _read_gst(sentence: Any, found: dict[str, Any]) -> None:
    north, east = _number(sentence.stdLat, "sigma"), _number(sentence.stdLong, "sigma")
    # One number for both axes: the root mean square of the two.
    found["sigma"] = math.hypot(north, east) / math.sqrt(2)


_READERS = {"GGA": _read_gga, "RMC": _read_rmc, "VTG": _read_vtg, "GST": _read_gst}


def _read_position(sentence: Any, found: dict[str, Any], *, valid: bool) -> None:
    if valid:
        found["latitude"] = _number(sentence.lat, "latitude")
        found["longitude"] = _number(sentence.lon, "longitude")


def _number(value: object, what: str) -> float:
    """Return a field's number, NaN where it is empty."""
    if value == "" or value is None:
        return math.nan
    if isinstance(value, bool) or not isinstance(value, int | float) or not math.isfinite(value):
        raise FormatError(f"GPS: {what} {value!r}: expected a number")
    return float(value)


def _fix(found: dict[str, Any]) -> Fix:
    """Return the fix; a position is only in it together with a quality that stands for it."""
    quality = found["quality"]
    latitude, longitude = found.get("latitude", math.nan), found.get("longitude", math.nan)
    if quality is FixQuality.NONE:
        latitude = longitude = math.nan
    elif not (abs(latitude) <= 90 and abs(longitude) <= 180):
        raise FormatError(
            f"GPS: a fix of quality {quality} at latitude {latitude} and longitude {longitude}"
        )
    keys = ("altitude", "hdop", "sigma", "speed", "course") if quality else ("hdop",)
    return Fix(
        latitude_deg=latitude,
        longitude_deg=longitude,
        quality=quality,
        satellites=found.get("satellites"),
        utc_ns=found.get("utc_ns"),
        **{key: found[key] for key in keys if key in found},
    )


def cut_report(data: bytes, start: int) -> Cut[dict[str, Any]]:
    """Cut one line of gpsd's JSON off the bytes; see `Framer`."""
    if data[start : start + 1] != b"{":
        found = data.find(b"{", start)
        return Cut((found if found >= 0 else len(data)) - start)
    end = data.find(b"\n", start)
    if end < 0:
        return Cut(0)
    try:
        report = json.loads(data[start : end + 1])
    except (ValueError, RecursionError):
        return Cut(end + 1 - start, None, _NOT_JSON)
    return Cut(end + 1 - start, report)


_SKY_LIFE = 30  # reports; gpsd sends SKY more rarely than TPV


class Gpsd:
    """A gpsd server: its TPV reports, with the dilution of precision of its SKY reports.

    Parameters
    ----------
    latency : float
        From the moment a fix is for until it arrives [s].
    """

    def __init__(self, *, latency: float = 0.0) -> None:
        self.parser = Framer(cut_report, longest=_LONGEST_REPORT)
        self._latency = latency
        self._sky: dict[str, Any] = {}
        self._sky_age = 0

    def value(self, telegram: dict[str, Any]) -> Measured[Fix] | None:
        """Return the fix of a TPV report; None for any other report.

        Raises
        ------
        FormatError
            If the report holds what cannot be.
        """
        if telegram.get("class") == "SKY":
            self._sky, self._sky_age = telegram, 0
        if telegram.get("class") != "TPV":
            return None
        self._sky_age += 1
        sky = self._sky if self._sky_age <= _SKY_LIFE else {}
        return Measured(_tpv_fix(telegram, sky), self._latency)

    def conversation(self) -> Conversation[dict[str, Any]]:
        """Ask for reports; gpsd confirms with a WATCH report."""
        watch = b'?WATCH={"enable":true,"json":true};\n'
        if (yield Ask(watch, lambda report: report.get("class") == "WATCH", 2.0)) is None:
            raise DeviceTimeout(
                "gpsd: no answer to ?WATCH within 2 s: expected a gpsd server at this address"
            )

    def farewell(self) -> bytes:
        """Return what ends the reports."""
        return b'?WATCH={"enable":false};\n'


def _tpv_fix(report: dict[str, Any], sky: dict[str, Any]) -> Fix:
    found: dict[str, Any] = {"quality": _tpv_quality(report)}
    for key, name in (("latitude", "lat"), ("longitude", "lon"), ("sigma", "eph")):
        found[key] = _number(report.get(name), name)
    found["altitude"] = _number(report.get("altMSL", report.get("alt")), "altitude")
    found["speed"] = _number(report.get("speed"), "speed")
    found["course"] = from_compass(_number(report.get("track"), "track"))
    found["hdop"] = _number(sky.get("hdop"), "hdop")
    used = sky.get("uSat")
    found["satellites"] = used if isinstance(used, int) and not isinstance(used, bool) else None
    found["utc_ns"] = _utc_ns(report.get("time"))
    return _fix(found)


def _tpv_quality(report: dict[str, Any]) -> FixQuality:
    mode, status = report.get("mode", 0), report.get("status", 1)
    if not isinstance(mode, int) or not isinstance(status, int):
        raise FormatError(f"gpsd: mode {mode!r} and status {status!r}: expected whole numbers")
    return _STATUSES.get(status, FixQuality.GPS) if mode >= 2 else FixQuality.NONE


_ISO_TIME = re.compile(r"(\d{4})-(\d\d)-(\d\d)T(\d\d):(\d\d):(\d\d)(?:\.(\d{1,9}))?Z", re.ASCII)


def _utc_ns(text: object) -> int | None:
    """Return ``2026-05-01T12:00:00.250Z`` as nanoseconds since 1970."""
    if text is None:
        return None
    found = _ISO_TIME.fullmatch(text) if isinstance(text, str) else None
    if found is None or not 1 <= int(found[2]) <= 12:
        raise FormatError(f"gpsd: time {text!r}: expected such as 2026-05-01T12:00:00.250Z")
    seconds = calendar.timegm(tuple(int(part) for part in found.groups()[:6]))
    return seconds * 1_000_000_000 + int((found[7] or "0").ljust(9, "0"))
