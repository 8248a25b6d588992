"""Brings up an underwater vehicle whose buoyancy does not: when the motor has to help, and what the fins do."""

import math
from dataclasses import dataclass

from autonomy.control.fin_allocation import Fins, allocate_fins
from support.rotations import Vector

RISEN = 0.3  # m above the deepest depth; a vehicle that has risen by this much with its motor rises
RISES = 0.5  # m in the time that buoyancy has; one that rises more slowly needs its motor
RISES_BY_SPEED = 0.4  # m of it by the vertical speed or the altitude: a depth in feet shows three times the way
SETTLED = 2.0  # s without a greater depth, after which a vehicle no longer dives
ABOVE = 0.15  # m; help ends this far above the depth at which it begins
GENTLE, FULL_DEPTH = 0.25, 0.4  # share of the thrust at the surface, and m below it at which it is all
NEAR_SURFACE = 1.0  # m; there is no use in going astern
HELP_SINKS = 3.0  # m deeper than at its start, at which help only makes it worse
PULSE, COAST, SINKS_AGAIN = 3.0, 8.0, 0.2  # s, s, m: astern, the bow comes up in the end, and pauses let it down
AHEAD, AHEAD_TIME = math.radians(10.0), 1.0  # with the bow so far up, going ahead lifts it; s that a pitch is good for
STEEP, LEVELED = math.radians(-30.0), math.radians(-20.0)  # no plan pitches the bow down so far
STEEP_FOR, SINKS_STEEPLY, LONGEST_STOP = 0.5, 0.05, 8.0  # s, m/s upward at most, s: a dive that going astern stops
ROSE_FOR = 10.0  # s after RISES, in which it is the pitch that is wrong
SINKS_SLOWLY, COASTED, SINKS_FOR = 0.02, 0.5, 4.0  # m/s, m/s, s: no dive, but a weight that leads to the bottom
LEVEL = 1.5  # m deeper, at which the pitch may be wrong
BOW_DOWN, BOW_TIME = math.radians(-10.0), 1.5  # s; help that turns the bow farther down for so long is none
BOW_UP, SINKING, SINKING_TIME = math.radians(5.0), -0.05, 4.0  # m/s, s: a pitch is wrong with which help sinks for it
HELP_PATIENCE = 25.0  # s that help may take for RISEN
MISLEADS = 1.0  # m up by the vertical speed since help began, of a vehicle that is deeper: the pitch is wrong
PAUSE, HARMED = 60.0, 600.0  # s between two attempts ahead; and after one that turned the bow of a light vehicle down
UNFIXED, IN_THE_AIR = 10.0, -0.5  # s without a fix at the surface, and m, from which the depth may be wrong
SANK = 1.0  # m by the vertical speed, of a vehicle whose depth is that of the surface
FORGETS = 120.0  # s, time constant of this way: an error of the vertical speed below 8 mm/s is no way down
UNSEEN = 5.0  # m by the vertical speed alone, beyond those that the depth has jumped by; more is no climb
CLIMB, CLIMB_TIME = 3.0, 15.0  # m, s: a vehicle under water climbs as far with its motor, even if the depth drifts
LIFTED = 1.0  # m of it are enough by altitude and vertical speed: it may have stood on the bottom at first
AT_SURFACE = 120.0  # s at the surface without help, after which a vehicle counts as light again
SLOWEST = 5.0  # s/m, of a vehicle that rises with its motor
PITCH, PITCH_RATE = 1.5, 0.5  # N m/rad, N m s/rad, of a vehicle of 24 kg, as in Control.AUV.Attitude
ROLL, ROLL_RATE = 1.0, 0.2
RISING, RISING_GAIN = 0.25, 1.5  # m/s, N s, without an attitude
TURN = 0.1  # N m: a slow turn keeps the vehicle where it is
EFFECTS = 0.25, 0.5, 0.5  # N m/rad of a fin about roll, pitch, yaw


@dataclass
class AscentMonitor:
    """Decides when a vehicle without a plan needs its motor to rise.

    `surface` is the depth (m) of a vehicle at the surface, `delay` the time (s) that buoyancy has. `helping` means that
    the motor is needed, `heavy` that it was needed before, `failed` that the latest attempt ahead brought nothing:
    the next one is `astern`, since fins that are stuck may point the vehicle down, but ahead while the bow is up.
    `pitch_faulty` means that the pitch contradicts the depth, so that fins are better turned by the depth; `stops_dive`
    that the motor, astern, only brings up a bow that is far down. A heavy vehicle whose depth is that of the surface,
    but whose GPS has no fix there, gets help in spells: the depth may be wrong. So does one that sinks by its vertical
    speed, or whose depth has jumped.
    """

    surface: float
    delay: float
    helping: bool = False
    heavy: bool = False
    failed: bool = False
    astern: bool = False
    pitch_faulty: bool = False
    stops_dive: bool = False

    def __post_init__(self) -> None:
        self._depth = self._extreme = self._begun = -math.inf
        self._since = self._paused = self._harmed = self._deepest = -math.inf
        self._afloat: float | None = None
        self._doubted: float | None = None
        self._climbs, self._floats, self._bowed = False, False, math.inf
        self._sinks = math.inf
        self._risen, self._updated, self._sank = 0.0, math.nan, False
        self._unseen = self._jumped = self._risen_before = 0.0
        self._pulse, self._highest, self._coasts = math.inf, math.inf, -math.inf
        self._bow_up, self._pitched = False, -math.inf
        self._steep, self._stopped, self.stops_dive = math.inf, math.inf, False
        self._rose, self._grounds = -math.inf, math.inf
        self._altitude = self._lowest = math.nan

    @property
    def share(self) -> float:
        """The share of the thrust that is needed: less where it only keeps the vehicle at the surface."""
        ahead = GENTLE + (1.0 - GENTLE) * (self._depth - self.surface) / FULL_DEPTH
        ahead = 1.0 if self._climbs else ahead
        size = max(GENTLE, min(1.0, ahead))
        if not self.astern or self._turns_ahead:
            return size
        return 0.0 if self._updated < self._coasts else -size

    @property
    def _turns_ahead(self) -> bool:
        """Whether, in an attempt astern, going ahead lifts it now: fins that are jammed turn the bow up and down."""
        return self._bow_up and not self.pitch_faulty and self._updated - self._pitched < AHEAD_TIME

    def has_stalled(self, now: float, seconds: float) -> bool:
        """Whether help has brought nothing for a time (s)."""
        return self.helping and now - self._since > seconds

    def reset(self, now: float) -> None:
        """The vehicle is controlled by others at the time `now` (s)."""
        self.helping, self._extreme, self._since, self._afloat = False, -math.inf, now, None
        self._doubted, self._climbs, self._floats = None, False, False
        self._risen, self._updated, self._sank = 0.0, math.nan, False
        self._unseen, self.pitch_faulty = 0.0, False
        self.astern &= not self.stops_dive
        self._steep, self._stopped, self.stops_dive = math.inf, math.inf, False
        self._rose, self._grounds, self._altitude = -math.inf, math.inf, math.nan

    def update(
        self,
        now: float,
        depth: float,
        surfaced: bool,
        unfixed: bool = False,
        rising: float | None = None,
        jumped: float = 0.0,
    ) -> None:
        """Take a depth (m) of a vehicle that should rise; one that has `surfaced` is at the surface at any depth.

        `unfixed` means that GPS, which had fixes, has none now. `rising` is the vertical speed upward (m/s), None if
        it is unknown: a vehicle rises if depth and speed show it, or depth and altitude, since a pitch that is wrong
        makes the speed wrong. `jumped` (m) is by how much the depth has become less at once.
        """
        elapsed = 0.0 if math.isnan(self._updated) else now - self._updated
        if elapsed > 0.0:
            self._risen += self._depth - depth if rising is None else rising * elapsed
        self._depth, self._updated = depth, now
        self._end_long_stop(now)
        if rising is None:
            self._grounds, self._altitude = math.inf, math.nan
        shallow = depth <= self.surface + (ABOVE if self._climbs else -ABOVE if self.helping else 0.0)
        if shallow and unfixed and not surfaced:
            self._risen *= 1.0 if self._climbs else math.exp(-elapsed / FORGETS)
            self._sank |= jumped > 0.0 or self._risen < -SANK
            self._jumped = jumped
            if self.heavy or depth < IN_THE_AIR or self._sank:
                self._climb(now, depth)
                return
        self.heavy |= surfaced and self._climbs and self._risen > SANK
        self._doubted, self._climbs, self._sank = None, False, False
        self._risen = 0.0 if surfaced else self._risen
        if surfaced or shallow:
            self._float(now)
        elif self.helping and not self.stops_dive:
            self._extreme = max(self._extreme, depth)
            self._pause_astern(now, depth)
            if depth < self._extreme - RISEN:
                self._extreme, self._since, self.failed = depth, now, False
            elif self._keeps_level(now, depth) or self._is_misled(depth):
                self._begun, self._since, self.pitch_faulty = depth, now, True
            elif depth > NEAR_SURFACE and (now - self._since > HELP_PATIENCE or depth > self._begun + HELP_SINKS):
                self._fail(now)
        else:
            self._wait(now, depth)

    def update_without_depth(self, now: float, depth: float, elapsed: float) -> None:
        """Help for the time that the last depth (m) takes; it was measured `elapsed` s ago."""
        self._end_long_stop(now)
        self._grounds, self._altitude = math.inf, math.nan
        if elapsed > self.delay:
            self.stops_dive = False
            self.helping = depth > self.surface and elapsed < self.delay + SLOWEST * depth
            self._depth, self._since, self.astern = depth, now, False

    def stop_dive(self, now: float, pitch: float, rising: float) -> None:
        """Go astern, once, where a bow that is far down (rad) keeps a vehicle without a plan from rising (m/s).

        So it leaves the bottom, or does not reach it, before its bow comes up: then an astern thrust lifts no more.
        The pitch of one that has just risen by depth and altitude is wrong, and so is its vertical speed.
        """
        if self.stops_dive:
            if pitch > LEVELED or not self.helping:
                self._end_stop(now)
            return
        dives = rising < SINKS_STEEPLY and now - self._rose > ROSE_FOR
        steep = pitch < STEEP and dives and self._depth > NEAR_SURFACE and self._updated == now
        self._steep = min(self._steep, now) if steep else math.inf
        if now - self._steep > STEEP_FOR and self._stopped == math.inf and not (self.helping or self.astern):
            self.helping = self.astern = self.stops_dive = True
            self._stopped, self._coasts = now, -math.inf

    def watch_bottom(self, now: float, altitude: float, speed: float, rising: float) -> None:
        """Do not wait for the buoyancy of a vehicle that would be on the bottom before.

        `altitude` is that above the bottom (m, below zero if it is unknown), `speed` ahead and `rising` upward (m/s).
        On the bottom fins have no effect.
        """
        self._altitude = altitude if altitude >= 0.0 else math.nan
        reaches = 0.0 <= altitude < -rising * self.delay
        sinks = reaches and rising < -SINKS_SLOWLY and abs(speed) < COASTED
        self._grounds = min(self._grounds, now) if sinks else math.inf

    def _end_long_stop(self, now: float) -> None:
        """End it also where pitch and speed, which `stop_dive` needs, are missing."""
        if self.stops_dive and now - self._stopped > LONGEST_STOP:
            self._end_stop(now)

    def _end_stop(self, now: float) -> None:
        self.helping, self.astern, self.stops_dive = False, False, False
        self._since, self._extreme = now, -math.inf

    def record_pitch(self, now: float, pitch: float, pitching: float, rising: float = 0.0) -> None:
        """End help that turns the bow (rad, rad/s) farther down, as fins do that are jammed.

        `rising` is the speed upward by the depth (m/s), 0 if it is unknown: where the vehicle sinks with its bow up and
        its motor on, the pitch is wrong.
        """
        sinks = self.helping and not self.astern and pitch > BOW_UP and rising < SINKING
        self._sinks = min(self._sinks, now) if sinks else math.inf
        self.pitch_faulty |= now - self._sinks > SINKING_TIME
        self._bow_up, self._pitched = pitch > (0.0 if self._bow_up else AHEAD), now
        dives = self.helping and not self.astern and pitch < BOW_DOWN and pitching < 0.0
        self._bowed = min(self._bowed, now) if dives else math.inf
        if now - self._bowed <= BOW_TIME:
            return
        self._bowed = math.inf
        if self.heavy:
            self._fail(now)
        else:
            self.helping, self._climbs, self._floats, self._harmed = False, False, True, now

    def _float(self, now: float) -> None:
        if self.helping or self._afloat is None:
            self._afloat = now
        self.helping, self._extreme, self._since = False, -math.inf, now
        self.astern &= not self.stops_dive
        self.stops_dive = False
        self._pulse, self._highest, self._coasts = math.inf, math.inf, -math.inf
        if now - self._afloat > AT_SURFACE:
            self.heavy = self.failed = self.astern = False

    def _climb(self, now: float, depth: float) -> None:
        """Climb where the depth may be wrong, until the motor changes nothing more; try again later if it was heavy."""
        self._since = now
        if self._doubted is None:
            self._doubted = now
        sinks = self.heavy or self._risen < -SANK
        sinks_again = self.heavy and (depth < IN_THE_AIR or self._risen < -RISEN)
        patience = 0.0 if sinks_again else UNFIXED if sinks else PAUSE
        if not self._climbs and now - self._doubted < patience:
            return
        if not self._climbs:
            if now >= max(self._paused, self._harmed + HARMED) and (not self._floats or self._risen < -SANK):
                self.helping = self._climbs = True
                self._begun, self._doubted, self._risen, self._lowest = depth, now, 0.0, self._altitude
        elif now - self._doubted > CLIMB_TIME:
            lifted = self._begun - depth > CLIMB or min(self._altitude - self._lowest, self._risen) > LIFTED
            self._climbs = lifted or (self._risen > CLIMB and self._may_climb_unseen())
            self.heavy |= self._climbs
            self._begun, self._doubted, self._risen, self._lowest = depth, now, 0.0, self._altitude
            if not self._climbs:
                self.helping, self._paused, self._floats = False, now + PAUSE, not self.heavy

    def _pause_astern(self, now: float, depth: float) -> None:
        """Coast when going astern no longer lifts the vehicle: its jammed fins have turned the bow up."""
        if not self.astern or now < self._coasts or self._turns_ahead:
            self._pulse = self._highest = math.inf
            return
        self._pulse, self._highest = min(self._pulse, now), min(self._highest, depth)
        if depth > self._highest + SINKS_AGAIN and now - self._pulse > PULSE:
            self._coasts = now + COAST

    def _keeps_level(self, now: float, depth: float) -> bool:
        """Whether help ahead has kept the vehicle at its depth, as with a pitch that is wrong by that of the ascent."""
        ahead = not self.astern and not self.pitch_faulty
        return ahead and now - self._since > HELP_PATIENCE and NEAR_SURFACE < depth < self._begun + LEVEL

    def _is_misled(self, depth: float) -> bool:
        """Whether help ahead has brought the vehicle down although its pitch, and so its vertical speed, say up."""
        ahead = not self.astern and not self.pitch_faulty
        return ahead and self._risen - self._risen_before > MISLEADS and depth > self._begun + SINKS_AGAIN

    def _may_climb_unseen(self) -> bool:
        """Whether the way up by the vertical speed alone is likely; the pitch, if wrong, makes that wrong as well."""
        self._unseen += self._risen
        if self._unseen < self._jumped + UNSEEN:
            return True
        likely, self._unseen, self.pitch_faulty = not self.pitch_faulty, 0.0, True
        return likely

    def _wait(self, now: float, depth: float) -> None:
        """Wait for buoyancy, longer where a dive had to end first; one that was too heavy gets help as it sinks."""
        if depth > self._extreme:
            self._extreme, self._deepest, self._risen, self._lowest = depth, now, 0.0, math.nan
        self._lowest = self._altitude if math.isnan(self._lowest) else self._lowest
        risen = self._risen > RISES_BY_SPEED or self._altitude - self._lowest > RISES_BY_SPEED
        if depth < self._extreme - RISES and risen:
            self._extreme, self._since, self._deepest, self._risen = depth, now, now, 0.0
            self._rose, self._lowest = now, self._altitude
        sinks = self.heavy and self._afloat is not None and depth > self.surface
        begins = SETTLED < now - self._deepest <= self.delay
        grounds = now - self._grounds > SINKS_FOR
        if (sinks or grounds or (now - self._since > self.delay and not begins)) and now >= self._paused:
            self.helping = self.heavy = True
            self._begun = self._extreme = depth
            self._since, self._risen_before = now, self._risen

    def _fail(self, now: float) -> None:
        faulty, stopped = self.pitch_faulty, self._stopped
        self.reset(now)
        self._stopped, self.failed, self.astern, self.pitch_faulty = stopped, True, not self.astern, faulty
        self._paused = now if self.astern else now + PAUSE
        self._since = now - self.delay


def ascent_fins(angles: Vector, rates: Vector, pitch: float, limit: float) -> Fins:
    """Deflections (rad) of four fins in a cross that hold a `pitch` (rad) up, level, in a slow turn, within `limit`.

    `angles` are roll, pitch and yaw (rad), `rates` those of the body (rad/s); the gains suit a vehicle of 24 kg.
    """
    torques = -ROLL * angles[0] - ROLL_RATE * rates[0], PITCH * (pitch - angles[1]) - PITCH_RATE * rates[1], TURN
    return allocate_fins(torques, EFFECTS, limit)


def blind_ascent_fins(rising: float, limit: float) -> Fins:
    """Deflections (rad) without an attitude, from the speed upward alone (m/s): it shows whether the bow is up."""
    return allocate_fins((0.0, RISING_GAIN * (RISING - rising), 0.0), EFFECTS, limit)
