"""Two images, or a disparity file, become one float32 `DisparityMap`."""

from bearcub.stereo.encodings import Encoding
from bearcub.stereo.formats import read_disparity, write_disparity
from bearcub.stereo.stage import StereoStage, from_disparity

__all__ = ["Encoding", "StereoStage", "from_disparity", "read_disparity", "write_disparity"]
