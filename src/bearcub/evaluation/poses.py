"""What a vehicle's recorded poses say of its nodding, of the road and of the way it took.

Poses are KITTI's: ``first_from_camera``, 3 x 4, camera axes x right, y down, z ahead, in the frame
of the first camera.
"""

from pathlib import Path

import numpy as np

from bearcub.errors import FormatError, InputError
from bearcub.messages import Float64


def read_poses(path: Path) -> Float64:
    """Read KITTI's ``poses.txt``: twelve numbers a line, row by row.

    Returns
    -------
    ndarray of float64, shape (N, 3, 4)

    Raises
    ------
    InputError
        If the file cannot be read.
    FormatError
        If a line does not hold twelve numbers.
    """
    try:
        text = path.read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as error:
        raise InputError(f"{path}: cannot be read: {error}") from error
    poses = []
    for number, line in enumerate(text.splitlines(), 1):
        try:
            values = [float(word) for word in line.split()]
        except ValueError as error:
            raise FormatError(f"{path}, line {number}: {error}, expected 12 numbers") from error
        if len(values) != 12:
            raise FormatError(f"{path}, line {number}: {len(values)} numbers, expected 12")
        poses.append(values)
    return np.array(poses).reshape(-1, 3, 4)


def nose_down(poses: Float64) -> Float64:
    """Return every camera's pitch against the first, nose down positive [rad].

    The inclination of the optical axis to the first camera's x-z plane: y points down, so an axis
    with a positive y component looks down.

    Examples
    --------
    >>> s, c = np.sin(np.radians(2)), np.cos(np.radians(2))
    >>> looking_down = [[1, 0, 0, 0], [0, c, s, 0], [0, -s, c, 0]]
    >>> np.degrees(nose_down(np.array([looking_down]))).round(6)
    array([2.])
    """
    x, y, z = poses[:, :, 2].T
    return np.asarray(np.arctan2(y, np.hypot(x, z)), dtype=np.float64)


def climb(poses: Float64, *, ahead: float) -> Float64:
    """Return the road's inclination ahead of every pose, up positive [rad], in the first's frame.

    The camera rides at a constant height, so its path rises as the road does. The inclination is
    that of the line from each position to the one that is `ahead` metres farther along the way,
    or to the last; where less than half of that is left, it is that of the last half.

    Examples
    --------
    >>> poses = np.zeros((4, 3, 4))
    >>> poses[:, :, :3] = np.eye(3)
    >>> poses[:, 2, 3] = [0, 5, 10, 15]
    >>> poses[:, 1, 3] = [0, 0, -0.5, -1.0]
    >>> np.degrees(climb(poses, ahead=10.0)).round(2)
    array([2.86, 5.71, 5.71, 5.71])
    """
    positions = poses[:, :, 3]
    run = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(positions, axis=0), axis=1))])
    start = np.minimum(run, max(run[-1] - 0.5 * ahead, 0.0))
    end = np.minimum(run + ahead, run[-1])
    at = [(np.interp(start, run, p), np.interp(end, run, p)) for p in positions.T]
    dx, dy, dz = (b - a for a, b in at)
    return np.asarray(np.arctan2(-dy, np.hypot(dx, dz)), dtype=np.float64)


def way_ahead(poses: Float64, index: int) -> Float64:
    """Return where the vehicle went from one pose on, in ``base_link`` of that pose.

    Returns
    -------
    ndarray of float64, shape (N - index, 2)
        x ahead and y left of the camera [m]; the first is (0, 0). The camera's small pitch
        against the road is left out: it shortens the way by its cosine.

    Examples
    --------
    >>> poses = np.zeros((2, 3, 4))
    >>> poses[:, :, :3] = np.eye(3)
    >>> poses[1, :, 3] = [0.5, 0.0, 4.0]  # half a metre to the right, four ahead
    >>> way_ahead(poses, 0)
    array([[ 0. ,  0. ], [ 4. , -0.5]])
    """
    turn, origin = poses[index, :, :3], poses[index, :, 3]
    optical = (poses[index:, :, 3] - origin) @ turn  # turn.T @ each
    return np.stack([optical[:, 2], -optical[:, 0]], axis=1) + 0.0
