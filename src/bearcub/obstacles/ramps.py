"""What looks like a thing and is ground that climbs on."""

from bearcub.ground.surface import Surface
from bearcub.messages import Ground
from bearcub.obstacles.measure import BEFORE, STEP, Extent

_WELL_BEFORE = 1.3  # times a thing's disparity is ground that tells how the floor climbs there


def over_a_crest(
    extent: Extent, ground: Ground, surface: Surface, *, focal: float, carried: float
) -> bool:
    """Tell what rises no higher than the floor would that climbs to where it is seen no more.

    A matcher carries the crest of a ramp up by its window, and the ground behind is not seen.

    Parameters
    ----------
    extent : Extent
    ground : Ground
    surface : Surface
        The same.
    focal : float
        Focal length times baseline [px m].
    carried : float
        How far up the matcher carries things there [m].
    """
    d = focal / max(extent.distance, 1e-6)
    if len(ground.knots) == 0 or d > BEFORE * (ground.knots[0] + ground.bend[0]):
        return False
    before = extent.distance * (1 / BEFORE - 1 / _WELL_BEFORE)
    climb = (extent.ground - surface.lift(_WELL_BEFORE * d)) / before
    risen_by = STEP + 3 * extent.sigma_distance + extent.distance * (1 - 1 / BEFORE)
    return extent.front < climb * risen_by + carried


def carries_on(
    ramp: Extent, extent: Extent, *, across: bool, blur: float, least: float, overhead: float
) -> bool:
    """Tell what is only more of a ramp: behind its foot, and no higher than it goes on.

    Or in the air: what is left of ground that far above.

    Parameters
    ----------
    ramp, extent : Extent
        Ground that climbs, and something else.
    across : bool
        The ramp is as wide as the view.
    blur : float
        How far the noise carries what is seen there along the line of sight [m].
    least : float
        Height of the lowest thing [m].
    overhead : float
        Height of what does not block the way [m].
    """
    behind = extent.distance - ramp.distance
    aside = abs(extent.bearing - ramp.bearing) * extent.distance
    if behind <= 0 or (not across and aside >= 0.5 * (extent.width + ramp.width)):
        return False
    goes_on = ramp.ground + ramp.front + ramp.climb * (behind + blur) + least
    return extent.lowest >= overhead or extent.ground + extent.front < goes_on
