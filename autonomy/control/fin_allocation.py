"""Distributes torques to four fins in a cross."""

from support.number_parsing import clamp_magnitude

Fins = tuple[float, float, float, float]
Torques = tuple[float, float, float]


def allocate_fins(wanted: Torques, effects: Torques, limit: float, crossed: float = 0.0) -> Fins:
    """Deflections (rad) of the fins below, at port, at starboard and above for torques about roll, pitch, yaw (N m).

    `effects` are the torques of a fin (N m/rad). No fin goes beyond `limit` (rad). `crossed` (rad) deflects the fins of
    each pair against each other, which brakes; yaw is not controlled then. Roll gets what pitch and yaw leave: an equal
    part from each fin, and the rest from the pair with more room.
    """
    k, m, n = wanted
    roll, pitch, yaw = effects
    free = limit - crossed
    vertical = clamp_magnitude(-n / (2.0 * yaw), free) if not crossed else 0.0
    horizontal = clamp_magnitude(-m / (2.0 * pitch), free)
    share = k / roll / 4.0
    left_vertical, left_horizontal = free - abs(vertical), free - abs(horizontal)
    on_vertical = clamp_magnitude(share, left_vertical)
    on_horizontal = clamp_magnitude(2.0 * share - on_vertical, left_horizontal)
    on_vertical = clamp_magnitude(2.0 * share - on_horizontal, left_vertical)
    return (
        vertical - on_vertical + crossed,
        horizontal + on_horizontal + crossed,
        horizontal - on_horizontal - crossed,
        vertical + on_vertical - crossed,
    )


def fin_torques(fins: Fins, effects: Torques) -> Torques:
    """Torques about roll, pitch, yaw (N m) of deflections (rad); the inverse of `allocate_fins` within the limits."""
    below, port, starboard, above = fins
    roll, pitch, yaw = effects
    return roll * (port - starboard - below + above), -pitch * (port + starboard), -yaw * (below + above)
