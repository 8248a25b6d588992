"""The parameters of the task that keeps a multirotor in the air."""

import math

from autonomy.control import GRAVITY, MultirotorGains, PIDGains
from runtime import Task, param


class MultirotorAutopilotTask(Task):
    """Parameters of a multirotor's autopilot: its sensors, gains, limits and timeouts."""

    ahrs: str = param("AHRS", "", "Entity of acceleration.", name="Entity Label - AHRS")
    barometer: str = param("Barometer", "", "Entity of pressure.", name="Entity Label - Barometer")
    batteries: str = param("Batteries", "", "Entity of the rotors' voltage.", name="Entity Label - Batteries")

    velocity_gains: list[float] = param([1.8, 0.5, 0.0], "1/s", "P, I, D.", name="Velocity PID Gains", size=3)
    vertical_gains: list[float] = param([3.0, 1.5, 0.0], "1/s", "P, I, D.", name="Vertical PID Gains", size=3)
    integral_limit: float = param(3.0, "m/s²", "Limit of both integrals.", minimum=0)
    position_gain: float = param(0.8, "1/s", "Gain of position and height while hovering.", minimum=0)
    heading_gain: float = param(1.5, "1/s", "Gain of the heading.", minimum=0)
    maximum_heading_rate: float = param(60.0, "°/s", "Largest heading rate.", minimum=1)
    maximum_tilt: float = param(25.0, "°", "Largest angle from the vertical.", minimum=1, maximum=45)
    maximum_acceleration: float = param(2.5, "m/s²", "Fastest change of the velocity reference.", minimum=0.1)
    maximum_speed: float = param(12.0, "m/s", "Highest speed over ground.", minimum=0.1)
    maximum_climb_rate: float = param(3.0, "m/s", "Fastest climb.", minimum=0.1)
    maximum_descent_rate: float = param(1.5, "m/s", "Fastest descent.", minimum=0.1)
    landing_rate: float = param(0.5, "m/s", "Descent near the ground.", minimum=0.1)
    landing_altitude: float = param(5.0, "m", "The landing rate applies below this altitude.", minimum=0)
    hover_actuation: float = param(0.7, "1", "Rotor speed that carries the weight, of full.", minimum=0.1, maximum=1)
    reference_timeout: float = param(0.5, "s", "Without a velocity for this long, the vehicle hovers.", minimum=0.1)
    state_timeout: float = param(
        0.5,
        "s",
        "Without EstimatedState for this long, it is level and keeps its height; for twice as long, it descends.",
        minimum=0.1,
    )
    idle_timeout: float = param(60.0, "s", "It lands after this time without a maneuver; 0 for never.", minimum=0)
    error_timeout: float = param(10.0, "s", "Idle timeout after an error; 0 for never.", minimum=0)
    landing_fuel_level: float = param(10.0, "%", "The vehicle lands below this battery level.", minimum=0, maximum=100)

    @property
    def gains(self) -> MultirotorGains:
        """The gains and limits of the control law, in SI units and radians."""

        def pid(gains: list[float]) -> PIDGains:
            return PIDGains(*gains, integral_limit=self.integral_limit, limit=2.0 * GRAVITY)

        return MultirotorGains(
            horizontal=pid(self.velocity_gains),
            vertical=pid(self.vertical_gains),
            position=self.position_gain,
            heading=self.heading_gain,
            heading_rate=math.radians(self.maximum_heading_rate),
            tilt=math.radians(self.maximum_tilt),
            acceleration=self.maximum_acceleration,
            speed=self.maximum_speed,
            climb=self.maximum_climb_rate,
            descent=self.maximum_descent_rate,
            landing_rate=self.landing_rate,
            landing_altitude=self.landing_altitude,
            thrust=GRAVITY / self.hover_actuation**2,
        )
