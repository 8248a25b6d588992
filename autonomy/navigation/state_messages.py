"""The messages that navigation of an underwater vehicle publishes."""

import math
from collections.abc import Sequence

import imc
from autonomy.navigation.depth_filter import DepthFilter
from autonomy.navigation.gnss_position_correction import PositionEstimate
from autonomy.navigation.horizontal_filter import EAST, NORTH, PSI, PSI_BIAS, R_BIAS, K, R, U, V
from imc.reserved_ids import EMPTY_HEADER
from support.rotations import Vector, rotate_to_ned, wrap


def initial_state(
    place: imc.GpsFix, vertical: DepthFilter, angles: Vector, rates: Vector, alt: float
) -> imc.EstimatedState:
    """The state of a vehicle that has no position but that of a fix."""
    phi, theta, psi = angles
    p, q, r = rates
    depth = max(0.0, vertical.depth)
    return imc.EstimatedState(
        lat=place.lat,
        lon=place.lon,
        height=place.height,
        z=depth,
        phi=wrap(phi),
        theta=theta,
        psi=wrap(psi),
        vz=vertical.rate,
        p=p,
        q=q,
        r=r,
        depth=depth,
        alt=alt,
    )


def estimated_state(
    position: PositionEstimate, vertical: DepthFilter, angles: Vector, rates: Vector, heave: float, alt: float
) -> imc.EstimatedState:
    """The state from both filters, roll and pitch of `angles` (rad), `rates` (rad/s), `heave` (m/s), altitude (m)."""
    x = position.filter.x
    phi, theta, _ = angles
    psi = wrap(x[PSI])
    vx, vy, _ = rotate_to_ned(phi, theta, psi, (x[U], x[V], heave))
    depth, (p, q, r) = max(0.0, vertical.depth), rates
    place, pose = (position.lat, position.lon, position.height), (x[NORTH], x[EAST], depth, wrap(phi), theta, psi)
    motion = x[U], x[V], heave, vx, vy, vertical.rate, p, q, r - x[R_BIAS]
    return imc.EstimatedState(*EMPTY_HEADER, *place, *pose, *motion, depth, alt)


def navigation_uncertainty(
    position: PositionEstimate, vertical: DepthFilter, doubt: float, noise: Sequence[float]
) -> imc.NavigationUncertainty:
    """The variances of both filters; that of depth includes a `doubt` (m), `noise` is that of the measurements."""
    variance = position.filter.state_variance
    attitude, rate = noise[2], noise[3]
    depth, sinking = vertical.variances
    return imc.NavigationUncertainty(
        x=variance(NORTH),
        y=variance(EAST),
        z=depth + doubt * doubt,
        phi=attitude,
        theta=attitude,
        psi=variance(PSI),
        p=rate,
        q=rate,
        r=variance(R),
        u=variance(U),
        v=variance(V),
        w=sinking,
        bias_psi=variance(PSI_BIAS),
        bias_r=variance(R_BIAS),
    )


def navigation_data(position: PositionEstimate, state: imc.EstimatedState) -> imc.NavigationData:
    """The biases and the speed per rpm of the filter, course and heading."""
    x = position.filter.x
    course = math.atan2(state.vy, state.vx)
    return imc.NavigationData(bias_psi=x[PSI_BIAS], bias_r=x[R_BIAS], cog=course, cyaw=state.psi, custom_x=x[K])
