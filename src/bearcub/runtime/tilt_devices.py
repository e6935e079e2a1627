"""Tilt sensors and IMUs of the configuration file."""

from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Any

from bearcub.devices.driver import Driver
from bearcub.devices.protocols import Source
from bearcub.devices.stream import Streaming
from bearcub.devices.tilt.angles import AIRCRAFT, REP_103, Convention
from bearcub.devices.tilt.complementary import Fused, OwnAcceleration
from bearcub.devices.tilt.cxtilt import Cxtilt
from bearcub.devices.tilt.hmr3000 import Hmr3000
from bearcub.devices.tilt.mip import Mip, MipInertial
from bearcub.devices.tilt.tcm2 import Tcm2
from bearcub.devices.tilt.vectornav import VectorNav, VectorNavInertial
from bearcub.devices.tilt.xdr import Xdr
from bearcub.devices.tilt.xsens import Xsens, XsensInertial
from bearcub.runtime.device_lines import Build, Place, serial_line
from bearcub.runtime.device_settings import ImuDevice, TiltDevice

_Make = Callable[..., Driver[Any, Any]]


def _tilt(make: _Make, *, baud: int, rate_hz: float) -> Build:
    """Return the builder of a sensor that tells its own attitude, at its own pace."""

    def build(settings: TiltDevice, place: Place) -> Source[Any]:
        speed = settings.baud or baud
        driver = make(baud=speed, **_signs(AIRCRAFT, settings))
        return _streaming(driver, settings, place, baud=speed, rate_hz=rate_hz)

    return build


def _cxtilt(settings: TiltDevice, place: Place) -> Source[Any]:
    driver = Cxtilt(rate_hz=settings.rate_hz or 20.0, **_signs(AIRCRAFT, settings))
    return _streaming(driver, settings, place, baud=settings.baud or 9600, rate_hz=20.0)


def _imu(make: _Make, raw: _Make, *, rate_hz: int, signs: Convention = AIRCRAFT) -> Build:
    """Return the builder of an IMU, asked for its attitude or for what it is made of."""

    def build(settings: ImuDevice, place: Place) -> Source[Any]:
        baud = settings.baud or 115200
        asked = {"rate_hz": round(settings.rate_hz) or rate_hz, "baud": baud}
        driver = (
            Fused(raw(**asked), clock=place.clock, own=OwnAcceleration(place.wheels))
            if settings.fused
            else make(**asked, **_signs(signs, settings))
        )
        return _streaming(driver, settings, place, baud=baud, rate_hz=rate_hz)

    return build


def _streaming(
    driver: Driver[Any, Any], settings: TiltDevice, place: Place, *, baud: int, rate_hz: float
) -> Source[Any]:
    return Streaming(
        serial_line(settings.port, baud),
        driver,
        clock=place.clock,
        rate_hz=settings.rate_hz or rate_hz,
        role=place.role,
    )


def _signs(own: Convention, settings: TiltDevice) -> dict[str, Convention]:
    """Return the signs to set; none where the driver's own knowledge of them is not changed."""
    if not (settings.invert_pitch or settings.invert_roll):
        return {}
    inverted = replace(
        own,
        nose_up=own.nose_up != settings.invert_pitch,
        right_down=own.right_down != settings.invert_roll,
    )
    return {"convention": inverted}


def _os5000(**options: Any) -> Tcm2:
    return Tcm2(start=b"", **options)  # it sends without being asked to


TILT_KINDS: Mapping[str, tuple[type[Any], Build]] = {
    "cxtilt": (TiltDevice, _cxtilt),
    "tcm2": (TiltDevice, _tilt(Tcm2, baud=9600, rate_hz=10.0)),
    "os5000": (TiltDevice, _tilt(_os5000, baud=19200, rate_hz=10.0)),
    "hmr3000": (TiltDevice, _tilt(Hmr3000, baud=19200, rate_hz=10.0)),
    "nmea": (TiltDevice, _tilt(Xdr, baud=4800, rate_hz=10.0)),
    "vectornav": (ImuDevice, _imu(VectorNav, VectorNavInertial, rate_hz=40)),
    "mip": (ImuDevice, _imu(Mip, MipInertial, rate_hz=50)),
    "xsens": (ImuDevice, _imu(Xsens, XsensInertial, rate_hz=50, signs=REP_103)),
}
"""What a table's `kind` may be, its settings and its builder."""
