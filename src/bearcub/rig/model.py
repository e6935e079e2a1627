"""The rig: a stereo camera, its mount on the body, and where both come from."""

from dataclasses import dataclass, field, replace
from pathlib import Path

from bearcub.rig.camera import Camera, Lens, Rectification
from bearcub.rig.checks import check_camera, check_mount
from bearcub.rig.mount import Mount
from bearcub.rig.reading import Hints, read_calibration
from bearcub.rig.rig_toml import write_toml
from bearcub.rig.values import naming, number

__all__ = ["Camera", "Mount", "Rig"]


@dataclass(frozen=True, slots=True, kw_only=True)
class Rig:
    """A stereo camera on a robot.

    Attributes
    ----------
    camera : Camera
        The pair after rectification.
    mount : Mount
    lenses : tuple of Lens, or None
        The raw left and right camera when the images still have to be rectified.
    source : str
        Where the rig was read, for messages; not compared.
    """

    camera: Camera
    mount: Mount
    lenses: tuple[Lens, Lens] | None = None
    source: str = field(default="", compare=False)

    @classmethod
    def load(
        cls,
        path: Path | str,
        *,
        right: Path | str | None = None,
        height: float | None = None,
        pitch_deg: float | None = None,
        roll_deg: float | None = None,
        x: float | None = None,
        y: float | None = None,
        size: tuple[int, int] | None = None,
        unit: float | None = None,
        cameras: tuple[int, int] | None = None,
        rectified: bool = False,
    ) -> "Rig":
        """Read a rig from any calibration file it knows, told apart by what is in it.

        Rig TOML, KITTI ``calib.txt``, Middlebury ``calib.txt``, ROS ``camera_info`` YAML, OpenCV
        ``stereoRectify`` YAML and Kalibr ``camchain.yaml``.

        Parameters
        ----------
        path : path
            The file, or a folder that holds one or a pair of the usual names.
        right : path, optional
            The second file of a ROS pair (the right camera) or of an OpenCV pair; without it the
            file of the matching name beside `path` is taken.
        height, pitch_deg, roll_deg, x, y : float, optional
            The mount [m], [deg]. They override the file's; `height` is required where the file
            has none, the others default to 0.
        size : tuple of int, optional
            Width and height of the images [px]. Without it a file that names no size leaves it 0,
            unknown until the first image (`for_image`).
        unit : float, optional
            Metres per unit of length in a calibration that is not in metres: 0.001 for
            millimetres, the side of a square for one in squares.
        cameras : tuple of int, optional
            Numbers of the left and right camera where a file has more than two. Default: KITTI
            2 and 3 (colour) where present, else 0 and 1; Kalibr 0 and 1.
        rectified : bool
            The images are rectified already: leave the file's distortion alone.

        Raises
        ------
        BearcubError
            `ConfigError`, `CalibrationError` or `FormatError` with one sentence that names the
            file, the value found and what was expected; `InputError` when `size` does not fit.
        """
        other = None if right is None else Path(right)
        hints = Hints(right=other, size=size, unit=unit, cameras=cameras)
        found = read_calibration(Path(path), hints)
        options = {"height": height, "pitch_deg": pitch_deg, "roll_deg": roll_deg, "x": x, "y": y}
        given = {
            key: number(value, f"mount.{key}")
            for key, value in options.items()
            if value is not None
        }
        with naming(found.source):
            mount = Mount.from_table({**found.mount, **given})
        lenses = None if rectified else found.lenses
        rig = cls(camera=found.camera, mount=mount, lenses=lenses, source=found.source)
        rig.check()
        return rig if size is None else rig.for_image(width=size[0], height=size[1])

    @property
    def rectification(self) -> Rectification | None:
        """How the raw pair is rectified; None when the images are used as they are."""
        if self.lenses is None:
            return None
        return Rectification(camera=self.camera, left=self.lenses[0], right=self.lenses[1])

    def for_image(self, *, width: int, height: int) -> "Rig":
        """Return the rig for images of this size.

        A size that was unknown is set; another size of the same aspect scales the camera by the
        pixel-centre rule.

        Raises
        ------
        InputError
            If the aspect differs from that of the calibration.
        ConfigError
            If the size shows that the calibration belongs to other images (principal point
            outside, absurd field of view).

        Examples
        --------
        >>> camera = Camera(width=0, height=0, fx=707, fy=707, cx=602, cy=183, baseline=0.537)
        >>> rig = Rig(camera=camera, mount=Mount(height=1.65))
        >>> rig.for_image(width=1226, height=370).for_image(width=613, height=185).camera.fx
        353.5
        """
        with naming(self.source):
            camera = self.camera.for_image(width=width, height=height)
            check_camera(camera)
        if self.rectification is None:
            return replace(self, camera=camera)
        sized = self.rectification.for_image(width=width, height=height)
        return replace(self, camera=camera, lenses=(sized.left, sized.right))

    def check(self) -> None:
        """Check every number; a rig made by `load` has passed.

        Raises
        ------
        ConfigError
            If one cannot be right: a unit, a sign, a size.
        """
        with naming(self.source):
            check_mount(self.mount)
            check_camera(self.camera)

    def to_toml(self) -> str:
        """Return the rig as a rig TOML; loading it and printing it again gives the same text."""
        return write_toml(self.camera, self.mount, self.lenses)
