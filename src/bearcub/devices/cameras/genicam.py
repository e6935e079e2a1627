"""GenICam cameras (GigE Vision, USB3 Vision) through harvesters and the maker's GenTL producer."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from bearcub.clock import Clock
from bearcub.devices.cameras.capture import Taken, decode_pixels
from bearcub.devices.cameras.plugins import PluginSettings, import_sdk
from bearcub.errors import ConfigError, DeviceDisconnected, DeviceError, DeviceTimeout, FormatError
from bearcub.messages import UInt8

_PATIENCE = 2.0  # s


@dataclass(frozen=True, slots=True, kw_only=True)
class Component:
    """One image of a GenTL buffer: `data` as harvesters gives it, and what it means."""

    data: Any
    width: int
    height: int
    pixel_format: str


def convert(components: Sequence[Component], *, name: str, stamp_ns: int) -> Taken:
    """Return one or two images as taken pictures.

    Parameters
    ----------
    components : sequence of Component
        Left, then right; of one stereo camera, or one each of two.
    name : str
        The camera's, for messages.
    stamp_ns : int
        When they arrived [ns].

    Raises
    ------
    FormatError
        If there are not one or two, they differ in size, or their format is unknown.
    """
    if len(components) not in (1, 2):
        raise FormatError(f"{name}: {len(components)} images in a buffer, expected one or two")
    pictures: list[UInt8] = [
        decode_pixels(
            part.data,
            width=part.width,
            height=part.height,
            pixel_format=part.pixel_format,
            name=name,
        )
        for part in components
    ]
    if pictures[0].shape != pictures[-1].shape:
        raise FormatError(
            f"{name}: pictures of shapes {pictures[0].shape} and {pictures[1].shape}, "
            "expected one size; set Width, Height and PixelFormat of both alike"
        )
    right = pictures[1] if len(pictures) == 2 else None
    return Taken(left=pictures[0], right=right, stamp_ns=stamp_ns)


class GenicamCapture:
    """One camera, or two that a trigger line releases together.

    Parameters
    ----------
    settings : PluginSettings
        `library` is the producer; `device` a serial number, or two with a comma in between.
    clock : Clock
        Stamps pictures on arrival.
    """

    def __init__(self, settings: PluginSettings, clock: Clock) -> None:
        if not settings.library:
            raise ConfigError(
                "a GenICam camera needs library = FILE.cti, the GenTL producer of its maker"
            )
        self.name = f"GenICam {settings.device}".strip()
        self._settings = settings
        self._clock = clock
        self._harvester: Any = None
        self._cameras: list[Any] = []

    def open(self) -> None:
        """Open the camera or cameras and start them."""
        serials = [serial for serial in self._settings.device.split(",") if serial]
        core: Any = import_sdk("harvesters.core", package="harvesters")
        self._harvester = core.Harvester()
        try:
            self._harvester.add_file(self._settings.library, check_existence=True)
            self._harvester.update()
            keys: list[Any] = [{"serial_number": serial.strip()} for serial in serials] or [0]
            for key in keys:
                camera = self._harvester.create(key)
                self._cameras.append(camera)
                self._set(camera.remote_device.node_map)
                camera.start()
        except (OSError, ValueError, RuntimeError, AttributeError) as error:
            raise DeviceError(f"cannot be opened: {error}") from error

    def take(self) -> Taken:
        """Wait for the next picture of each."""
        if not self._cameras:
            raise DeviceDisconnected("is not open")
        components: list[Component] = []
        for camera in self._cameras:
            buffer = camera.try_fetch(timeout=_PATIENCE)
            if buffer is None:
                raise DeviceTimeout(f"no picture within {_PATIENCE:g} s; check cable and trigger")
            with buffer:
                # The memory goes back to the camera at the end of the block.
                components += [_copied(part) for part in buffer.payload.components]
        return convert(components, name=self.name, stamp_ns=self._clock.now_ns())

    def close(self) -> None:
        """Stop the cameras."""
        cameras, self._cameras = self._cameras, []
        for camera in cameras:
            camera.stop()
            camera.destroy()
        harvester, self._harvester = self._harvester, None
        if harvester is not None:
            harvester.reset()

    def _set(self, nodes: Any) -> None:
        """Set what the settings name; a camera without such a feature raises."""
        settings = self._settings
        if settings.width:
            nodes.Width.value, nodes.Height.value = settings.width, settings.height
        if settings.exposure_ms:
            nodes.ExposureAuto.value = "Off"
            nodes.ExposureTime.value = settings.exposure_ms * 1e3


def _copied(part: Any) -> Component:
    return Component(
        data=part.data.copy(),
        width=part.width,
        height=part.height,
        pixel_format=part.data_format,
    )


def build(settings: PluginSettings, clock: Clock) -> GenicamCapture:
    """Return the camera or cameras of the settings."""
    return GenicamCapture(settings, clock)
