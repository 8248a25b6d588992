"""The parameters of a task that leads an autopilot."""

from runtime import ParameterError, Task, param
from runtime.vehicle import general_number

LATE = 3.0  # s without HEARTBEAT, which comes each second
LONGEST_GAP = 120.0  # s


class AutopilotTask(Task):
    """Parameters of a task that leads an autopilot: its place, requests to it, guidance, the end of a flight."""

    external = True
    requires = "mavlink"

    address: str = param(
        "udpin://127.0.0.1:14560",
        "",
        "Address of the autopilot: udpin://, udpout://, tcpout://HOST:PORT or serial:///DEVICE?baud=.",
        editable=False,
    )
    autopilot_id: int = param(
        0, "1", "MAVLink system id of the autopilot; 0 is the first that is received.", minimum=0, maximum=255,
        editable=False,
    )  # fmt: skip
    input_timeout: float = param(
        3.0, "s", "Without HEARTBEAT for this time, or `[General] Longest Radio Gap`, the autopilot is lost.",
        minimum=1.5, maximum=120,
    )  # fmt: skip
    position_timeout: float = param(
        2.0, "s", "A position that is older is none, and ends the plan, unless HEARTBEAT is late, too.", minimum=0.5,
        maximum=60,
    )  # fmt: skip
    attitude_rate: float = param(10.0, "Hz", "Rate of EstimatedState.", minimum=1, maximum=100)
    position_rate: float = param(5.0, "Hz", "Rate of positions.", minimum=1, maximum=50)
    sensor_rate: float = param(2.0, "Hz", "Rate of GpsFix and of other measurements.", minimum=0.1, maximum=50)
    geoid_undulation: float = param(
        0.0, "m", "Height of the geoid above the ellipsoid.", minimum=-120, maximum=100, editable=False
    )
    near_radius: float = param(
        2.0, "m", "A path is done within this distance of its end.", name="Radius To Endpoint", minimum=0.1
    )
    height_tolerance: float = param(0.4, "m", "A path is done within this distance of its height.", minimum=0.1)
    ending: str = param("hold", "", "Action after an Abort.", choices=("hold", "return", "land", "disarm"))
    idle_timeout: float = param(
        60.0, "s", "An aircraft ends its flight after this time without a maneuver; 0 for never.", minimum=0
    )

    px4_guidance: str = param(
        "hold", "", "Guidance of PX4: by commands in its mode hold, or by a stream of setpoints in offboard.",
        name="PX4 Guidance", choices=("hold", "offboard"), editable=False,
    )  # fmt: skip
    uploads: bool = param(
        False, "", "Store each plan in the autopilot, which then continues it if this computer fails.",
        name="Plans In Memory", editable=False,
    )  # fmt: skip
    approach_length: float = param(400.0, "m", "Length of a plane's straight final approach.", minimum=50, maximum=5000)
    approach_height: float = param(30.0, "m", "Height at its beginning, above home.", minimum=5, maximum=500)
    landing_course: float = param(
        -1.0, "°", "Course of a plane that lands, such as that of a runway; -1 is against the wind.", minimum=-1,
        maximum=360,
    )  # fmt: skip
    aiding_entity: str = param(
        "", "", "Entity whose GpsFix, or USBL fixes of this vehicle if it is USBL, are the autopilot's GPS.",
        editable=False,
    )  # fmt: skip

    @property
    def longest_silence(self) -> float:
        """Silence (s) after which the autopilot is lost."""
        return max(self.input_timeout, self._gap)

    @property
    def latest_heartbeat(self) -> float:
        """Age of HEARTBEAT (s) from which nothing is sent to an autopilot, nor repeated, that may not receive it."""
        return min(self.position_timeout, LATE)

    def configure(self) -> None:
        self._gap = general_number(self.vehicle.profile, "Longest Radio Gap", 0.0)
        if not 0.0 <= self._gap <= LONGEST_GAP:
            raise ParameterError("Longest Radio Gap", f"[General] has {self._gap:g} s (expects 0 to {LONGEST_GAP:g} s)")
