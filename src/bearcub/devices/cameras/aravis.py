"""GenICam cameras (GigE Vision, USB3 Vision) through Aravis, which needs no maker's software."""

from dataclasses import replace
from typing import Any

import numpy as np

from bearcub.clock import Clock
from bearcub.devices.cameras.capture import Taken
from bearcub.devices.cameras.genicam import Component, convert
from bearcub.devices.cameras.plugins import PluginSettings, import_sdk
from bearcub.errors import DeviceDisconnected, DeviceError, DeviceTimeout

_PATIENCE_US = 2_000_000
_BUFFERS = 4
_PACKAGES = "python3-gi gir1.2-aravis-0.8"
_FRAME_NUMBERS = 65536  # of GigE Vision; 0 is left out


def component(data: bytes, *, width: int, height: int, pixel_format: str) -> Component:
    """Return one Aravis buffer as an image: its bytes are those of the pixel format's numbers.

    Parameters
    ----------
    data : bytes
        Little-endian, of any buffer that is not packed.
    width, height : int
        [px].
    pixel_format : str
        Name of the Pixel Format Naming Convention.
    """
    if pixel_format.endswith("8"):
        values = np.frombuffer(data, np.uint8)
    else:
        values = np.frombuffer(data[: len(data) // 2 * 2], np.dtype("<u2"))
    return Component(data=values, width=width, height=height, pixel_format=pixel_format)


def lost_between(before: int | None, number: int) -> int:
    """Return how many frames are missing between two frame numbers of 16 bit.

    Examples
    --------
    >>> lost_between(7, 8), lost_between(7, 10), lost_between(65535, 1), lost_between(None, 9)
    (0, 2, 0, 0)
    """
    if before is None:
        return 0
    return max(0, (number - before) % (_FRAME_NUMBERS - 1) - 1)


class _Camera:
    """One opened camera."""

    def __init__(self, library: Any, name: str, settings: PluginSettings) -> None:
        self._library = library
        self._camera = library.Camera.new(name or None)
        if settings.width:
            self._camera.set_region(0, 0, settings.width, settings.height)
        if self._camera.is_frame_rate_available():
            self._camera.set_frame_rate(settings.rate_hz)
        if settings.exposure_ms:
            if self._camera.is_exposure_auto_available():
                self._camera.set_exposure_time_auto(library.Auto.OFF)
            self._camera.set_exposure_time(settings.exposure_ms * 1e3)
        self._pixel_format = self._camera.get_pixel_format_as_string()
        self._stream = self._camera.create_stream(None, None)
        for _ in range(_BUFFERS):
            self._stream.push_buffer(library.Buffer.new_allocate(self._camera.get_payload()))
        self._number: int | None = None
        self._camera.start_acquisition()

    def take(self) -> tuple[Component, int]:
        """Wait for the next whole picture; return it and how many were lost before it."""
        buffer = self._stream.timeout_pop_buffer(_PATIENCE_US)
        if buffer is None:
            raise DeviceTimeout(
                f"no picture within {_PATIENCE_US * 1e-6:g} s; check cable and trigger"
            )
        try:
            if buffer.get_status() != self._library.BufferStatus.SUCCESS:
                raise DeviceDisconnected(
                    f"a picture came incomplete ({buffer.get_status().value_nick}); "
                    "check the network's packet size"
                )
            before, self._number = self._number, buffer.get_frame_id()
            image = component(
                bytes(buffer.get_data()),
                width=buffer.get_image_width(),
                height=buffer.get_image_height(),
                pixel_format=self._pixel_format,
            )
            return image, lost_between(before, self._number)
        finally:
            self._stream.push_buffer(buffer)

    def stop(self) -> None:
        """Stop it and let go of it."""
        self._camera.stop_acquisition()
        self._stream = self._camera = None


class AravisCapture:
    """One camera, or two that a trigger line releases together.

    Parameters
    ----------
    settings : PluginSettings
        `device` is what ``arv-tool-0.8`` calls it, or two such names with a comma in between;
        ``Fake_1`` is a camera of Aravis that draws its pictures.
    clock : Clock
        Stamps pictures on arrival.
    """

    def __init__(self, settings: PluginSettings, clock: Clock) -> None:
        self.name = f"Aravis {settings.device}".strip()
        self._settings = settings
        self._clock = clock
        self._cameras: list[_Camera] = []

    def open(self) -> None:
        """Open the camera or cameras and start them."""
        library = _library()
        names = [name.strip() for name in self._settings.device.split(",")]
        if any(name.startswith("Fake") for name in names):
            library.enable_interface("Fake")
        try:
            for name in names:
                self._cameras.append(_Camera(library, name, self._settings))
        except (RuntimeError, TypeError) as error:  # GLib's own error is a RuntimeError
            self.close()
            raise DeviceError(f"cannot be opened: {error}; see: arv-tool-0.8") from error

    def take(self) -> Taken:
        """Wait for the next picture of each."""
        if not self._cameras:
            raise DeviceDisconnected("is not open")
        images, lost = zip(*(camera.take() for camera in self._cameras), strict=True)
        taken = convert(images, name=self.name, stamp_ns=self._clock.now_ns())
        return replace(taken, dropped=sum(lost))

    def close(self) -> None:
        """Stop the cameras."""
        cameras, self._cameras = self._cameras, []
        for camera in cameras:
            camera.stop()


def _library() -> Any:
    """Return Aravis, which its introspection data makes a Python module of."""
    install = f"sudo apt install {_PACKAGES}"
    introspection: Any = import_sdk("gi", package="PyGObject", install=install)
    try:
        introspection.require_version("Aravis", "0.8")
    except ValueError as error:
        raise DeviceError(f"Aravis 0.8 is not installed ({error}); run: {install}") from error
    return import_sdk("gi.repository.Aravis", package="Aravis", install=install)


def build(settings: PluginSettings, clock: Clock) -> AravisCapture:
    """Return the camera or cameras of the settings."""
    return AravisCapture(settings, clock)
