"""Matching at half the resolution: a quarter of the pixels, half the disparities."""

import cv2
import numpy as np

from bearcub.messages import Float32, UInt8
from bearcub.stereo.images import shrunk
from bearcub.stereo.matchers import Matcher, SearchRange


class HalfResolution:
    """Matches a pair that is shrunk by two, and answers at its full size.

    What is found is right to about half a pixel of the full size; the refinement, which looks at
    the full images, brings back the rest. Edges stay as coarse as they were found.

    Parameters
    ----------
    matcher : Matcher
        Matches the small pairs; its numbers are in their pixels.

    Examples
    --------
    >>> from bearcub.stereo.matchers import CallableMatcher
    >>> small = CallableMatcher(lambda left, right: np.zeros(left.shape) + 1.5, largest=31)
    >>> half = HalfResolution(small)
    >>> half(np.zeros((3, 6), np.uint8), np.zeros((3, 6), np.uint8))[2]
    array([nan, nan, nan, nan,  3.,  3.], dtype=float32)
    >>> half.largest
    62.0
    """

    def __init__(self, matcher: Matcher) -> None:
        self._matcher = matcher
        self.smallest = 2.0 * matcher.smallest
        self.largest = 2.0 * matcher.largest
        self.fattening = 2.0 * matcher.fattening

    def __call__(self, left: UInt8, right: UInt8) -> Float32:
        """Return the disparity of each left pixel [px], NaN where unmatched.

        An odd last row or column answers like its neighbour.
        """
        rows, columns = left.shape[:2]
        height, width = rows // 2, columns // 2
        pair = (
            shrunk(image[: 2 * height, : 2 * width], width=width, height=height)
            for image in (left, right)
        )
        # The means of two by two pixels stand halfway between them in both images alike.
        found = np.float32(2) * self._matcher(*pair)
        whole = cv2.resize(found, (2 * width, 2 * height), interpolation=cv2.INTER_NEAREST)
        bottom, aside = rows - 2 * height, columns - 2 * width
        bordered = cv2.copyMakeBorder(whole, 0, bottom, 0, aside, cv2.BORDER_REPLICATE)
        return np.asarray(bordered, dtype=np.float32)


def halved(search: SearchRange) -> SearchRange:
    """Return the range that covers `search` in pairs shrunk by two, to a pixel at the near end.

    Examples
    --------
    >>> halved(SearchRange(smallest=0, count=64))
    SearchRange(smallest=0, count=32)
    """
    smallest, largest = search.smallest // 2, search.largest // 2
    return SearchRange(smallest=smallest, count=16 * -(-(largest - smallest + 1) // 16))
