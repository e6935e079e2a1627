"""Emulated GPS receivers: one that sends NMEA sentences, and a gpsd server."""

import json
import math
import re
from collections.abc import Callable
from dataclasses import dataclass

from bearcub.devices.nmea import encode
from bearcub.emulators.emulator import Serial, Ticker

_KNOTS = 3600 / 1852
_DAY = "221126"  # the emulated receiver's date: 22 November 2026
_MODES = {0: "N", 1: "A", 2: "D", 3: "P", 4: "R", 5: "F", 6: "E"}
_STATUSES = {2: 2, 3: 9, 4: 3, 5: 4, 6: 5}  # from GGA's quality to gpsd's status; else 1


@dataclass(frozen=True, slots=True, kw_only=True)
class Position:
    """What a receiver measures, in its own terms.

    Attributes
    ----------
    latitude_deg, longitude_deg : float
        North and east positive [deg].
    altitude : float
        Above mean sea level [m].
    speed : float
        [m/s].
    course_deg : float
        Clockwise from north [deg].
    quality : int
        As in GGA; 0 is no fix.
    satellites : int
    hdop : float
    """

    latitude_deg: float = 39.1317
    longitude_deg: float = -84.5167
    altitude: float = 256.0
    speed: float = 0.0
    course_deg: float = 0.0
    quality: int = 1
    satellites: int = 9
    hdop: float = 0.9


Where = Callable[[int], Position]
"""Where the receiver is at a time [ns]."""


def circling(now_ns: int) -> Position:
    """Return where a robot is that drives a circle of 20 m radius at 1 m/s, to the left."""
    turned = now_ns * 1e-9 / 20.0
    metre = 1 / 111_320.0  # degrees of latitude
    return Position(
        latitude_deg=39.1317 + 20.0 * math.sin(turned) * metre,
        longitude_deg=-84.5167 + 20.0 * math.cos(turned) * metre / math.cos(math.radians(39.1317)),
        speed=1.0,
        course_deg=math.degrees(-turned) % 360.0,
    )


class NmeaEmulator(Serial):
    """A receiver on a serial line that sends RMC, VTG, GST and GGA of every epoch.

    Parameters
    ----------
    where : callable, optional
        Position at a time [ns].
    rate_hz : float
        Epochs per second [Hz].
    baud : int
        Of its line.
    """

    def __init__(self, where: Where = circling, *, rate_hz: float = 5.0, baud: int = 9600) -> None:
        self.baud = baud
        self._where = where
        self._ticker = Ticker(rate_hz)

    def receive(self, data: bytes) -> None:
        """Ignore it: the emulated receiver has no settings."""

    def poll(self, now_ns: int) -> bytes:
        """Return the sentences that are due."""
        return sentences(self._where(now_ns), now_ns) if self._ticker.due(now_ns) else b""


def sentences(position: Position, now_ns: int) -> bytes:
    """Return one epoch's sentences, for the time `now_ns` after midnight."""
    fixed = position.quality > 0
    time = _time_of_day(now_ns)
    place = (
        f"{_angle(position.latitude_deg, 'NS', 2)},{_angle(position.longitude_deg, 'EW', 3)}"
        if fixed
        else ",,,"
    )
    motion = f"{position.speed * _KNOTS:.3f},{position.course_deg:.2f}" if fixed else ","
    course = f"{position.course_deg:.2f},T,,M" if fixed else ",T,,M"
    speed = f"{position.speed * _KNOTS:.3f},N,{position.speed * 3.6:.3f},K" if fixed else ",N,,K"
    mode = _MODES[position.quality]
    sigma = f"{position.hdop * 2:.2f}" if fixed else ""
    altitude = f"{position.altitude:.1f}" if fixed else ""
    quality = f"{position.quality},{position.satellites:02d}"
    return b"".join(
        encode(body)
        for body in (
            f"GNRMC,{time},{'A' if fixed else 'V'},{place},{motion},{_DAY},,,{mode}",
            f"GNVTG,{course},{speed},{mode}",
            f"GNGST,{time},,,,,{sigma},{sigma},",
            f"GNGGA,{time},{place},{quality},{position.hdop:.2f},{altitude},M,,M,,",
        )
    )


def _angle(angle: float, letters: str, digits: int) -> str:
    minutes = round(abs(angle) * 60, 6)
    whole = int(minutes // 60)
    return f"{whole:0{digits}d}{minutes - 60 * whole:09.6f},{letters[angle < 0]}"


def _time_of_day(now_ns: int) -> str:
    milliseconds = now_ns // 1_000_000 % 86_400_000
    seconds, rest = divmod(milliseconds, 1000)
    return f"{seconds // 3600:02d}{seconds // 60 % 60:02d}{seconds % 60:02d}.{rest // 10:02d}"


_WATCH = re.compile(rb"\?WATCH=(\{.*?\});")
_LONGEST = 4096


class GpsdEmulator:
    """A gpsd server with one receiver: sends TPV and SKY to a client that asked for them.

    Parameters
    ----------
    where : callable, optional
        Position at a time [ns].
    rate_hz : float
        Reports per second [Hz].
    """

    baud = None

    def __init__(self, where: Where = circling, *, rate_hz: float = 5.0) -> None:
        self._where = where
        self._ticker = Ticker(rate_hz)
        self._heard = b""
        self._pending: list[dict[str, object]] = []
        self._watched = False

    def connect(self) -> None:
        """Greet a new client, who has to ask anew."""
        self._heard, self._watched = b"", False
        self._pending = [{"class": "VERSION", "release": "3.25", "proto_major": 3}]

    def receive(self, data: bytes) -> None:
        """Take requests; those but WATCH are ignored."""
        self._heard = (self._heard + data)[-_LONGEST:]
        while found := _WATCH.search(self._heard):
            self._heard = self._heard[found.end() :]
            try:
                asked = json.loads(found[1])
            except ValueError:
                self._pending.append({"class": "ERROR", "message": "Invalid WATCH"})
                continue
            self._watched = bool(asked.get("enable"))
            devices: dict[str, object] = {"class": "DEVICES", "devices": [{"path": "/dev/gps0"}]}
            self._pending += [devices, {"class": "WATCH", **asked}]

    def poll(self, now_ns: int) -> bytes:
        """Return the answers, and the reports that are due."""
        reports, self._pending = self._pending, []
        if self._watched and self._ticker.due(now_ns):
            reports += _reports(self._where(now_ns), now_ns)
        return b"".join(json.dumps(report).encode("ascii") + b"\r\n" for report in reports)


def _reports(position: Position, now_ns: int) -> list[dict[str, object]]:
    time = _time_of_day(now_ns)
    stamp = f"2026-11-22T{time[:2]}:{time[2:4]}:{time[4:]}0Z"
    sky: dict[str, object] = {
        "class": "SKY",
        "hdop": position.hdop,
        "uSat": position.satellites,
    }
    if position.quality == 0:
        return [sky, {"class": "TPV", "mode": 1, "time": stamp}]
    tpv: dict[str, object] = {
        "class": "TPV",
        "mode": 3,
        "status": _STATUSES.get(position.quality, 1),
        "time": stamp,
        "lat": position.latitude_deg,
        "lon": position.longitude_deg,
        "altMSL": position.altitude,
        "track": position.course_deg,
        "speed": position.speed,
        "eph": position.hdop * 2,
    }
    return [sky, tpv]
