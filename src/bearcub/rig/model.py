"""The rig: a rectified stereo camera and its mount on the body."""

from dataclasses import dataclass, replace

from bearcub.geometry import Attitude, Projection


@dataclass(frozen=True, slots=True, kw_only=True)
class Camera:
    """A rectified stereo camera.

    Attributes
    ----------
    width, height : int
        Image size [px].
    fx, fy, cx, cy : float
        Focal lengths and principal point of the left image [px]; pixel (0, 0) is the centre of
        the top-left one.
    baseline : float
        [m], positive.
    doffs : float
        ``cx_right - cx_left`` [px], added to measured disparities (Middlebury's `doffs`).
    """

    width: int
    height: int
    fx: float
    fy: float
    cx: float
    cy: float
    baseline: float
    doffs: float = 0.0

    def scaled(self, *, width: int, height: int) -> "Camera":
        """Return the camera of the same view at another image size (pixel-centre rule).

        Examples
        --------
        >>> vga = Camera(width=640, height=480, fx=386, fy=386, cx=319.5, cy=239.5, baseline=0.12)
        >>> half = vga.scaled(width=320, height=240)
        >>> half.fx, half.cx, half.cy
        (193.0, 159.5, 119.5)
        """
        sx, sy = width / self.width, height / self.height
        return replace(
            self,
            width=width,
            height=height,
            fx=self.fx * sx,
            fy=self.fy * sy,
            cx=(self.cx + 0.5) * sx - 0.5,
            cy=(self.cy + 0.5) * sy - 0.5,
            doffs=self.doffs * sx,
        )

    @property
    def projection(self) -> Projection:
        """What of the camera turns pixels into metres."""
        return Projection(fx=self.fx, fy=self.fy, cx=self.cx, cy=self.cy, baseline=self.baseline)


@dataclass(frozen=True, slots=True, kw_only=True)
class Mount:
    """Where the left camera sits on the body, with how well that is known (1-sigma).

    Attributes
    ----------
    height : float
        Above the ground under it [m].
    pitch, roll : float
        Against the body, REP-103 [rad].
    x, y : float
        In ``base_link`` [m]; 0 puts the origin on the ground under the camera.
    sigma_height : float
        [m]; NaN means the configured share of `height`.
    sigma_pitch, sigma_roll : float
        [rad]; NaN means the configured default.
    """

    height: float
    pitch: float = 0.0
    roll: float = 0.0
    x: float = 0.0
    y: float = 0.0
    sigma_height: float = float("nan")
    sigma_pitch: float = float("nan")
    sigma_roll: float = float("nan")

    @property
    def attitude(self) -> Attitude:
        """Roll and pitch as one value."""
        return Attitude(roll=self.roll, pitch=self.pitch)


@dataclass(frozen=True, slots=True, kw_only=True)
class Rig:
    """A stereo camera on a robot."""

    camera: Camera
    mount: Mount
