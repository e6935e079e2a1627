"""Every exception the project raises on purpose.

Each also derives from the builtin a caller who does not know us would catch.
"""


class BearcubError(Exception):
    """Something outside the program is wrong; the message is one sentence for the user."""


class ConfigError(BearcubError, ValueError):
    """A configuration or rig value is unknown or out of range."""


class FormatError(BearcubError, ValueError):
    """A file or byte sequence is not what it claims to be."""


class InputError(BearcubError, ValueError):
    """An input image, disparity map or reading cannot be what it is used as."""


class CalibrationError(BearcubError, ValueError):
    """A calibration is missing a value or contradicts itself."""


class DeviceError(BearcubError, OSError):
    """A camera, sensor, controller or file source failed."""


class DeviceTimeout(DeviceError, TimeoutError):  # noqa: N818 (conventions 2.6)
    """Nothing arrived within the time allowed."""


class DeviceDisconnected(DeviceError, ConnectionError):  # noqa: N818 (conventions 2.6)
    """The other end went away."""


class TransportError(BearcubError, ConnectionError):
    """Two machines of the robot cannot talk to each other."""
