"""The materials of the world: what floors and things look like, and their colours.

Colours are linear albedo (blue, green, red).
"""

from collections.abc import Mapping
from dataclasses import replace

from bearcub.sim.texture import Colour, Lane, Material, Painted, Stroke, Texture

ASPHALT = Material(
    dark=(0.045, 0.045, 0.047),
    light=(0.32, 0.33, 0.34),
    octaves=((3.1, 0.10), (1.1, 0.08), (0.37, 0.12), (0.13, 0.18), (0.05, 0.32), (0.02, 0.5)),
)
GRASS = Material(
    dark=(0.008, 0.040, 0.022),
    light=(0.085, 0.33, 0.22),
    octaves=((4.3, 0.22), (1.3, 0.18), (0.45, 0.25), (0.16, 0.32), (0.06, 0.5), (0.022, 0.7)),
    seed=1,
)
CONCRETE = Material(
    dark=(0.20, 0.215, 0.225),
    light=(0.40, 0.425, 0.44),
    octaves=((1.7, 0.25), (0.5, 0.25), (0.15, 0.3), (0.05, 0.3), (0.018, 0.3)),
    seed=2,
)
TILES = replace(CONCRETE, joints=(0.5, 0.015, 0.7), seed=3)
PLAIN = Material(dark=(0.35, 0.36, 0.37), light=(0.35, 0.36, 0.37))
BRICK = Material(
    dark=(0.06, 0.08, 0.20),
    light=(0.14, 0.18, 0.40),
    octaves=((0.9, 0.25), (0.3, 0.3), (0.1, 0.4), (0.04, 0.4)),
    joints=(0.25, 0.015, 0.5),
    seed=4,
)
WOOD = Material(
    dark=(0.05, 0.10, 0.17),
    light=(0.13, 0.24, 0.38),
    octaves=((0.6, 0.3), (0.2, 0.4), (0.07, 0.5), (0.03, 0.5)),
    seed=5,
)
SOIL = Material(
    dark=(0.05, 0.08, 0.12),
    light=(0.16, 0.22, 0.30),
    octaves=((0.9, 0.3), (0.3, 0.35), (0.1, 0.4), (0.04, 0.4), (0.018, 0.3)),
    seed=6,
)
ZINC: Colour = (0.42, 0.44, 0.45)
BLACK: Colour = (0.03, 0.03, 0.03)
WHITE: Colour = (0.68, 0.70, 0.70)
ORANGE: Colour = (0.03, 0.17, 0.62)
RED: Colour = (0.05, 0.05, 0.42)
YELLOW: Colour = (0.05, 0.48, 0.60)
BLUE: Colour = (0.38, 0.16, 0.06)
GREEN: Colour = (0.10, 0.26, 0.10)

CARPET = Material(
    dark=(0.16, 0.10, 0.08),
    light=(0.40, 0.26, 0.20),
    octaves=((0.7, 0.15), (0.2, 0.2), (0.06, 0.3), (0.024, 0.45), (0.012, 0.6)),
    seed=10,
)
GRAVEL = Material(
    dark=(0.05, 0.06, 0.065),
    light=(0.52, 0.56, 0.58),
    octaves=((2.3, 0.15), (0.8, 0.15), (0.24, 0.2), (0.09, 0.4), (0.045, 0.8), (0.022, 0.6)),
    seed=11,
)
STRONG_TILES = Material(
    dark=(0.40, 0.46, 0.50),
    light=(0.56, 0.62, 0.66),
    octaves=((1.1, 0.25), (0.35, 0.25), (0.11, 0.3), (0.035, 0.3)),
    joints=(0.4, 0.025, 0.85),
    seed=12,
)
SMOOTH_CONCRETE = replace(
    CONCRETE, octaves=tuple((wave, 0.5 * depth) for wave, depth in CONCRETE.octaves), seed=13
)
PATH = Lane(inside=ASPHALT, outside=GRASS, left=1.5, right=-1.9)


def dashes(
    y: float, *, start: float = 0.5, end: float = 20.0, dash: float = 1.0, gap: float = 1.0
) -> tuple[Stroke, ...]:
    """Return the strokes of a dashed line at `y`, from `start` to `end` ahead [m].

    It is 75 mm wide, as lanes are; `dash` and `gap` are the lengths of its pieces.
    """
    count = int((end - start) / (dash + gap))
    starts = [start + index * (dash + gap) for index in range(count)]
    return tuple(Stroke(start=(x, y), end=(x + dash, y), width=0.075) for x in starts)


PAINTED = Painted(
    ground=replace(GRASS, seed=14),
    strokes=(
        Stroke(start=(0.0, 1.5), end=(25.0, 1.7), width=0.075),
        *dashes(-1.6),
        Stroke(start=(2.5, -4.0), end=(5.5, 4.0), width=0.075),
        Stroke(start=(4.0, 0.4), end=(4.0, 0.4), width=0.61),  # a painted pothole of the IGVC
    ),
    paint=WHITE,
)

SURFACES: Mapping[str, Texture] = {
    "asphalt": ASPHALT,
    "tiles": STRONG_TILES,
    "carpet": CARPET,
    "gravel": GRAVEL,
    "concrete": CONCRETE,
    "smooth-concrete": SMOOTH_CONCRETE,
    "mown-grass": GRASS,
    "soil": SOIL,
    "painted": PAINTED,
    "path": PATH,
}
"""The floors that scenarios may name."""


def paint(
    colour: Colour,
    *,
    seed: int,
    bands: tuple[tuple[float, float, Colour], ...] = (),
    contrast: float = 0.3,
) -> Material:
    """Return a used, painted surface: blotches of so much contrast about one colour.

    `bands` and `seed` are those of `Material`.
    """
    b, g, r = colour
    dark, light = 1.0 - contrast, 1.0 + contrast
    return Material(
        dark=(dark * b, dark * g, dark * r),
        light=(light * b, light * g, light * r),
        octaves=((0.5, 0.3), (0.15, 0.4), (0.05, 0.4), (0.02, 0.4)),
        bands=bands,
        seed=seed,
    )
