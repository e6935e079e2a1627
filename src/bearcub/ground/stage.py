"""The ground stage: tilt, mount and image become one floor with its uncertainty."""

import math
from dataclasses import dataclass, replace

import numpy as np

from bearcub.errors import InputError
from bearcub.geometry import Attitude, Float64, Projection, camera_attitude, inverse
from bearcub.ground.fit import Gates, PlaneFit, fit_plane
from bearcub.ground.prior import Prior, expect
from bearcub.ground.profile import Profile, follow_floor, just_ahead
from bearcub.ground.underfoot import height_underfoot
from bearcub.messages import DisparityMap, Ground, Tilt
from bearcub.rig.model import Mount

_OTHER = 1.0  # sigmas off what mount and tilt reading say that tell another plane
_PULL = 0.75  # bias of a floor's disparity at the horizon [px], over the square of the noise
_CAUTION = 1.5  # times the variance that errors show, by which the plane is trusted
_STEEPER = math.radians(6.0)  # than a way may be, and still measured as ground
_EDGE = 1.1  # times its level is the nearest that the edge of a step may have: two bins
_UPSIDE_DOWN = 0.2  # share of the image that a floor at its top must cover, unlike a ceiling


@dataclass(frozen=True, slots=True, kw_only=True)
class GroundStage:
    """Find the floor of one frame.

    Attributes
    ----------
    projection : Projection
    mount : Mount
    gates : Gates
        How far from the prior a floor may lie.
    sigma_height_share : float
        1-sigma of the mount's height where the rig states none, as a share of it.
    sigma_mount, sigma_tilt : float
        1-sigma of the expected roll and pitch without and with a tilt reading [rad].
    unevenness : float
        Height of bumps that are still floor [m].
    steepest : float
        Steepest ground that is still floor [rad].
    least_support, least_share : float
        A floor is seen when at least this share of the pixels that could be floor, and this
        share of the image, lies on it.
    noise : float
        1-sigma of disparity where no floor tells it [px].
    """

    projection: Projection
    mount: Mount
    gates: Gates
    sigma_height_share: float
    sigma_mount: float
    sigma_tilt: float
    unevenness: float
    steepest: float
    least_support: float
    least_share: float
    noise: float

    def __call__(self, disparity: DisparityMap, tilt: Tilt | None) -> Ground:
        """Fit the floor, fuse it with the prior and follow its bend.

        Parameters
        ----------
        disparity : DisparityMap
        tilt : Tilt or None

        Returns
        -------
        Ground
            With ``seen`` False and the prior's plane when the image shows no floor.
        """
        prior = self.expect(tilt)
        fit = fit_plane(
            disparity.disparity,
            self.projection,
            prior,
            self.gates,
            unevenness=self.unevenness,
        )
        if fit is None or not self._convincing(fit, disparity):
            self._refuse_upside_down(prior, disparity)
            return self._unseen(prior)
        return self._seen(prior, fit, disparity)

    def expect(self, tilt: Tilt | None) -> Prior:
        """Return what mount and tilt reading say of the floor."""
        return expect(
            self.mount,
            tilt,
            sigma_height_share=self.sigma_height_share,
            sigma_mount=self.sigma_mount,
            sigma_tilt=self.sigma_tilt,
        )

    def _refuse_upside_down(self, prior: Prior, disparity: DisparityMap) -> None:
        """Raise when the picture turned by half a turn shows the floor this one lacks."""
        rows, columns = disparity.disparity.shape
        p = self.projection
        turned = replace(p, cx=columns - 1 - p.cx, cy=rows - 1 - p.cy)
        fit = fit_plane(
            disparity.disparity[::-1, ::-1], turned, prior, self.gates, unevenness=self.unevenness
        )
        if fit is None or not self._convincing(fit, disparity):
            return
        if fit.count > _UPSIDE_DOWN * disparity.disparity.size:
            raise InputError(
                "the floor is at the top of the image: the pair is upside down; "
                "turn both images by 180 degrees and swap left and right"
            )

    def _convincing(self, fit: PlaneFit, disparity: DisparityMap) -> bool:
        share = fit.count / disparity.disparity.size
        return fit.support >= self.least_support and share >= self.least_share

    def _unseen(self, prior: Prior) -> Ground:
        down = prior.attitude.down()
        plane = self.projection.plane(height=prior.height, down=down)
        jacobian = _plane_jacobian(self.projection, prior.values)
        return Ground(
            plane=plane,
            covariance=jacobian @ np.diag(prior.sigma**2) @ jacobian.T,
            height=prior.height,
            pitch=prior.pitch,
            roll=prior.roll,
            sigma_height=float(prior.sigma[0]),
            sigma_pitch=float(prior.sigma[1]),
            sigma_roll=float(prior.sigma[2]),
            noise=self.noise,
            source="tilt" if prior.tilted else "mount",
            seen=False,
            residual=math.nan,
            tilt_disagreement=math.nan,
        )

    def _seen(
        self, prior: Prior, fit: PlaneFit, disparity: DisparityMap, *, rising: bool = False
    ) -> Ground:
        """Return the floor that a fit shows; the prior's where it is known to be `rising` ahead."""
        values, covariance, ramp = self._fused(prior, fit, disparity, rising=rising)
        attitude = Attitude(pitch=float(values[1]), roll=float(values[2]))
        plane = self.projection.plane(height=float(values[0]), down=attitude.down())
        jacobian = _plane_jacobian(self.projection, values)
        profile = follow_floor(
            disparity.disparity,
            self.projection,
            plane,
            noise=fit.noise,
            height=float(values[0]),
            pitch=attitude.pitch,
            steepest=self.steepest + _STEEPER,
        )
        if ramp and not rising and profile.step > 0:
            before = self._before_step(profile, plane, prior, disparity)
            if before is not None:
                return self._seen(prior, before, disparity)
        more = np.zeros((3, 3))
        if not ramp:
            plane, profile, more = just_ahead(plane, profile)
        ahead = _values(self.projection, plane)
        if prior.tilted and not ramp and begins_ahead(prior.values, prior.sigma, values, ahead):
            return self._seen(prior, fit, disparity, rising=True)
        of_plane = jacobian @ covariance @ jacobian.T + more
        back = inverse(_plane_jacobian(self.projection, ahead))
        lowest = np.array([self.projection.cx, len(disparity.disparity) - 1.0, 1.0])
        pull = _pull(plane, noise=fit.noise, nearest=float(plane @ lowest))
        told = of_plane / _CAUTION + np.outer(pull, pull)
        sigma = np.sqrt(np.diag(back @ told @ back.T))
        return Ground(
            plane=plane,
            covariance=of_plane,
            height=float(ahead[0]),
            pitch=float(ahead[1]),
            roll=float(ahead[2]),
            sigma_height=float(sigma[0]),
            sigma_pitch=float(sigma[1]),
            sigma_roll=float(sigma[2]),
            noise=fit.noise,
            source="tilt+image" if prior.tilted else "image",
            seen=True,
            residual=fit.noise,
            tilt_disagreement=_angle(prior, ahead) if prior.tilted else math.nan,
            knots=profile.knots,
            bend=profile.bend,
            knot_noise=profile.noise,
            followed_to=profile.end,
        )

    def _before_step(
        self, profile: Profile, plane: Float64, prior: Prior, disparity: DisparityMap
    ) -> PlaneFit | None:
        """Fit the floor before a step up, where most of what is seen lies behind it.

        None where that floor does not lie as mount and tilt reading say.
        """
        behind = profile.knots < profile.step
        higher = float(np.max(1 + (profile.bend / profile.knots)[behind], initial=1.0))
        foot = higher * _EDGE * profile.step  # its face is as far as its edge, down to its foot
        d = disparity.disparity
        rows, columns = d.shape
        level = plane[1] * np.arange(rows)[:, None] + (plane[0] * np.arange(columns) + plane[2])
        near = np.where(level > foot, d, np.float32(np.nan))
        fit = fit_plane(near, self.projection, prior, self.gates, unevenness=self.unevenness)
        if fit is None or not self._convincing(fit, disparity):
            return None
        values, covariance = self._measured(fit)
        off = np.abs(values - prior.values) / np.sqrt(prior.sigma**2 + np.diag(covariance))
        return fit if off.max() < _OTHER else None

    def _measured(self, fit: PlaneFit) -> tuple[Float64, Float64]:
        """Return the (height, pitch, roll) of a fitted plane and their covariance."""
        values = _values(self.projection, fit.plane)
        back = inverse(_plane_jacobian(self.projection, values))
        return values, back @ fit.covariance @ back.T

    def _fused(
        self, prior: Prior, fit: PlaneFit, disparity: DisparityMap, *, rising: bool
    ) -> tuple[Float64, Float64, bool]:
        """Return (height, pitch, roll) and their covariance from prior and image together.

        The third value tells that what is seen rises or falls ahead, and the prior is the floor.
        """
        measured, covariance = self._measured(fit)
        rises = prior.tilted and rises_ahead(prior.values, prior.sigma, measured, covariance)
        if rising or rises:
            return prior.values, np.diag(prior.sigma**2), True
        measured[0] = height_underfoot(
            disparity.disparity, self.projection, fit, prior, unevenness=self.unevenness
        )
        return *fuse(prior.values, prior.sigma, measured, covariance), False


def rises_ahead(expected: Float64, sigma: Float64, measured: Float64, covariance: Float64) -> bool:
    """Tell ground that rises or falls before it comes into view from a tilt reading that is wrong.

    Both show a floor of another pitch than expected. But the floor of a wrong reading passes under
    the camera at the height it is mounted at; a ramp's, carried on to there, does not.

    Parameters
    ----------
    expected, sigma : ndarray of float64, shape (3,)
        The prior's (height, pitch, roll) and its 1-sigmas.
    measured : ndarray of float64, shape (3,)
    covariance : ndarray of float64, shape (3, 3)
        Of `measured`.

    Examples
    --------
    >>> expected, sigma = np.array([1.2, 0.1, 0.0]), np.array([0.12, 0.026, 0.026])
    >>> rises_ahead(expected, sigma, np.array([1.2, 0.2, 0.0]), np.zeros((3, 3)))
    False
    >>> rises_ahead(expected, sigma, np.array([1.5, 0.25, 0.0]), np.zeros((3, 3)))
    True
    """
    apart = np.abs(measured - expected) / np.sqrt(sigma**2 + np.diag(covariance))
    return bool(apart[0] > _OTHER and apart[1] > 3.0)


def begins_ahead(expected: Float64, sigma: Float64, fitted: Float64, ahead: Float64) -> bool:
    """Tell the beginning of a ramp from floor before one that was fitted across.

    A plane fitted to floor and ramp lies between both. The floor just ahead of the robot is nearer
    to what mount and reading say than that plane, a ramp's beginning is farther off.

    Parameters
    ----------
    expected, sigma : ndarray of float64, shape (3,)
        The prior's (height, pitch, roll) and its 1-sigmas.
    fitted, ahead : ndarray of float64, shape (3,)
        Of the plane fitted to all, and of the one laid through its nearest part.

    Examples
    --------
    >>> expected, sigma = np.array([1.2, 0.12, 0.0]), np.array([0.12, 0.026, 0.026])
    >>> fitted = np.array([1.14, 0.08, 0.0])
    >>> begins_ahead(expected, sigma, fitted, np.array([1.19, 0.11, 0.0]))
    False
    >>> begins_ahead(expected, sigma, fitted, np.array([1.07, 0.05, 0.0]))
    True
    """
    before, now = (np.abs(each - expected) / sigma for each in (fitted, ahead))
    return bool(now[1] - before[1] > _OTHER)


def fuse(
    expected: Float64, sigma: Float64, measured: Float64, covariance: Float64
) -> tuple[Float64, Float64]:
    """Weigh the prior's and the image's (height, pitch, roll) by their uncertainties.

    A prior that the image contradicts by more than three sigmas in one of them is wrong, not
    noisy (a biased or late tilt sensor, a mount measured badly), and has no say in that one.

    Parameters
    ----------
    expected, sigma : ndarray of float64, shape (3,)
        The prior and its 1-sigmas.
    measured : ndarray of float64, shape (3,)
    covariance : ndarray of float64, shape (3, 3)
        Of `measured`.

    Returns
    -------
    values : ndarray of float64, shape (3,)
    covariance : ndarray of float64, shape (3, 3)

    Examples
    --------
    >>> values, covariance = fuse(np.zeros(3), np.ones(3), np.array([1.0, 1.0, 9.0]), np.eye(3))
    >>> values
    array([0.5, 0.5, 9. ])
    """
    spread = np.sqrt(sigma**2 + np.diag(covariance))
    agrees = np.abs(measured - expected) <= 3 * spread
    information = np.diag(np.where(agrees, sigma**-2.0, 0.0))
    precision = inverse(covariance)
    fused = inverse(precision + information)
    return fused @ (precision @ measured + information @ expected), fused


def _pull(plane: Float64, *, noise: float, nearest: float) -> Float64:
    """Return 1-sigma of what a matcher's smoothness does to a floor, (a, b, c) [px].

    The noisier the pixels, the more their neighbours decide, and most where the disparity changes
    fastest with the range: the horizon is off in proportion to the square of the noise, the floor
    at the `nearest` level not at all. Measured on simulated floors of all surfaces and lights.
    """
    pull: Float64 = _PULL * noise**2 * (np.array([0.0, 0.0, 1.0]) - plane / nearest)
    return pull


def _values(projection: Projection, plane: Float64) -> Float64:
    height, down = projection.floor(plane)
    attitude = Attitude.from_down(down)
    return np.array([height, attitude.pitch, attitude.roll])


def _plane_jacobian(projection: Projection, values: Float64) -> Float64:
    """Return the derivative of (a, b, c) by (height, pitch, roll), shape (3, 3)."""
    height, pitch, roll = values.tolist()
    # the plane is linear in the direction down, so its derivative is the plane of the derivative
    sr, cr, sp, cp = math.sin(roll), math.cos(roll), math.sin(pitch), math.cos(pitch)
    downs = (sr * cp, cr * cp, sp), (-sr * sp, -cr * sp, cp), (cr * cp, -sr * cp, 0.0)
    by_height, by_pitch, by_roll = (projection.coefficients(height, *down) for down in downs)
    by_height = tuple(each / -height for each in by_height)
    return np.array(list(zip(by_height, by_pitch, by_roll, strict=True)))


def _angle(prior: Prior, measured: Float64) -> float:
    seen = Attitude(pitch=float(measured[1]), roll=float(measured[2])).down()
    return math.acos(min(max(float(prior.attitude.down() @ seen), -1.0), 1.0))


def gravity_in_camera(mount: Mount, tilt: Tilt) -> Float64:
    """Return the unit vector of gravity in optical axes, from a tilt reading of the body."""
    body = Attitude(roll=tilt.roll, pitch=tilt.pitch)
    return camera_attitude(body=body, mount=mount.attitude).down()
