"""Which matcher the configuration asks for, and what stands in for what was not compiled."""

import functools
import logging
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

from bearcub.config import Matching
from bearcub.errors import ConfigError
from bearcub.messages import Float32, UInt8
from bearcub.stereo.half import HalfResolution, halved
from bearcub.stereo.matchers import BmMatcher, Matcher, SearchRange, SgbmMatcher
from bearcub.stereo.native import (
    MOST_DISPARITIES,
    NativeMatcher,
    NativeRefinement,
    reason_missing,
)
from bearcub.stereo.onnx_matcher import OnnxMatcher
from bearcub.stereo.refine import refine

_PIXELS = 4  # of the full size in one of half the size

Refinement = Callable[[UInt8, UInt8, Float32], Float32]

_log = logging.getLogger(__name__)


def matcher_for(search: SearchRange, matching: Matching) -> Matcher:
    """Return the matcher that `matching` asks for, at half the resolution if it does.

    Where the native one was not compiled, or the search is wider than it can, OpenCV's
    semi-global matcher stands in; the log says so once.

    Raises
    ------
    BearcubError
        If a learned matcher is asked for without a model that can be run.
    """
    if matching.half_resolution:
        small = replace(
            matching, half_resolution=False, speckle_area=matching.speckle_area // _PIXELS
        )
        return HalfResolution(matcher_for(halved(search), small))
    if matching.matcher == "onnx":
        return _learned(search, matching)
    if matching.matcher == "native" and _native_can(search.count):
        return NativeMatcher(
            search,
            uniqueness=matching.uniqueness,
            left_right=matching.left_right,
            speckle_area=matching.speckle_area,
            threads=matching.threads,
        )
    kind = BmMatcher if matching.matcher == "bm" else SgbmMatcher
    return kind(
        search,
        block_size=matching.block_size,
        uniqueness=matching.uniqueness,
        left_right=matching.left_right,
    )


def matcher_in_place(matching: Matching) -> str:
    """Return the name of the matcher that does the work where the native one is not there."""
    missing = matching.matcher == "native" and reason_missing()
    return "sgbm" if missing else matching.matcher


def refinement(*, threads: int) -> Refinement:
    """Return the fastest form of the refinement that is there; all do the same."""
    return refine if reason_missing() else NativeRefinement(threads=threads)


def _learned(search: SearchRange, matching: Matching) -> OnnxMatcher:
    if not matching.model:
        raise ConfigError('matching.matcher = "onnx": expected a model file, too: matching.model')
    return OnnxMatcher(
        Path(matching.model),
        search,
        white=matching.model_white,
        left_right=matching.left_right,
        threads=matching.threads,
    )


def _native_can(count: int) -> bool:
    if reason_missing():
        _say_once(
            f"the native matcher is not there ({reason_missing()}); OpenCV's takes its place, "
            "several times slower: reinstall bearcub where there is a C++ compiler"
        )
        return False
    if count > MOST_DISPARITIES:
        _say_once(
            f"{count} disparities to search are more than the native matcher tries "
            f"({MOST_DISPARITIES}); OpenCV's takes its place, several times slower: shrink the "
            "images or set matching.nearest"
        )
        return False
    return True


@functools.cache
def _say_once(sentence: str) -> None:
    _log.warning("%s", sentence)
