"""The rectified stereo camera, and the lenses it was before rectification."""

from dataclasses import dataclass, replace

import numpy as np

from bearcub.errors import InputError
from bearcub.geometry import Projection
from bearcub.messages import Float64

NO_ROTATION = (1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0)


def _scaled_centre(centre: float, scale: float) -> float:
    """Scale a principal point when (0, 0) is the centre of the top-left pixel."""
    return (centre + 0.5) * scale - 0.5


def camera_matrix(*, fx: float, fy: float, cx: float, cy: float) -> Float64:
    """Return the 3 x 3 matrix of a pinhole camera [px]."""
    return np.array([[fx, 0.0, cx], [0.0, fy, cy], [0.0, 0.0, 1.0]])


@dataclass(frozen=True, slots=True, kw_only=True)
class Camera:
    """A rectified stereo camera.

    Attributes
    ----------
    width, height : int
        Image size [px]; both 0 while it is not known (`for_image` sets it).
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
            cx=_scaled_centre(self.cx, sx),
            cy=_scaled_centre(self.cy, sy),
            doffs=self.doffs * sx,
        )

    @property
    def projection(self) -> Projection:
        """What of the camera turns pixels into metres."""
        return Projection(fx=self.fx, fy=self.fy, cx=self.cx, cy=self.cy, baseline=self.baseline)

    @property
    def size_known(self) -> bool:
        """Whether the calibration said how large its images are."""
        return self.width > 0

    def for_image(self, *, width: int, height: int) -> "Camera":
        """Return the camera for images of this size: set where unknown, scaled where another.

        Raises
        ------
        InputError
            If the aspect differs by more than a pixel's rounding: that is a crop, and no scale
            can say where it was cut.
        """
        if not self.size_known:
            return replace(self, width=width, height=height)
        if abs(width * self.height - height * self.width) > max(self.width, self.height):
            raise InputError(
                f"the images are {width} x {height} px, but the rig is for {self.width} x "
                f"{self.height} px, another aspect: use the rig that belongs to these images"
            )
        return self.scaled(width=width, height=height)


@dataclass(frozen=True, slots=True, kw_only=True)
class Lens:
    """One camera of the pair as it is built: its own pinhole, distortion and direction.

    Attributes
    ----------
    fx, fy, cx, cy : float
        Of the raw image [px].
    model : str
        "plumb_bob" (Kalibr's radtan), "rational_polynomial" or "equidistant".
    distortion : tuple of float
        Coefficients in OpenCV's order; empty means none.
    rotation : tuple of float, length 9
        Row by row, the rotation ``rectified_from_raw``.
    """

    fx: float
    fy: float
    cx: float
    cy: float
    model: str = "plumb_bob"
    distortion: tuple[float, ...] = ()
    rotation: tuple[float, ...] = NO_ROTATION

    def scaled(self, scale_x: float, scale_y: float) -> "Lens":
        """Return the lens for images that are larger by these factors (pixel-centre rule)."""
        return replace(
            self,
            fx=self.fx * scale_x,
            fy=self.fy * scale_y,
            cx=_scaled_centre(self.cx, scale_x),
            cy=_scaled_centre(self.cy, scale_y),
        )

    @property
    def matrix(self) -> Float64:
        """The raw camera matrix K, shape (3, 3) [px]."""
        return camera_matrix(fx=self.fx, fy=self.fy, cx=self.cx, cy=self.cy)

    @property
    def coefficients(self) -> Float64:
        """The distortion coefficients D, shape (N,); four zeros when there are none."""
        return np.array(self.distortion or (0.0, 0.0, 0.0, 0.0))

    @property
    def rectified_from_raw(self) -> Float64:
        """The rectifying rotation R, shape (3, 3)."""
        return np.array(self.rotation).reshape(3, 3)


@dataclass(frozen=True, slots=True, kw_only=True)
class Rectification:
    """How a raw pair becomes the rectified pair of `camera`, which has the same image size."""

    camera: Camera
    left: Lens
    right: Lens

    @property
    def left_projection(self) -> Float64:
        """Camera matrix of the rectified left image, shape (3, 3) [px]."""
        c = self.camera
        return camera_matrix(fx=c.fx, fy=c.fy, cx=c.cx, cy=c.cy)

    @property
    def right_projection(self) -> Float64:
        """Camera matrix of the rectified right image, shape (3, 3) [px]."""
        c = self.camera
        return camera_matrix(fx=c.fx, fy=c.fy, cx=c.cx + c.doffs, cy=c.cy)

    def for_image(self, *, width: int, height: int) -> "Rectification":
        """Return the rectification of raw images of this size; see `Camera.for_image`."""
        camera = self.camera.for_image(width=width, height=height)
        scale = camera.fx / self.camera.fx, camera.fy / self.camera.fy
        return Rectification(
            camera=camera, left=self.left.scaled(*scale), right=self.right.scaled(*scale)
        )

    @property
    def needed(self) -> bool:
        """Whether it moves any pixel: a calibration of a rectified pair has nothing to undo."""
        pairs = (self.left, self.left_projection), (self.right, self.right_projection)
        return any(
            any(lens.distortion)
            or not np.allclose(lens.rotation, NO_ROTATION, rtol=0.0, atol=1e-6)
            or not np.allclose(lens.matrix, projection, rtol=0.0, atol=1e-3)
            for lens, projection in pairs
        )
