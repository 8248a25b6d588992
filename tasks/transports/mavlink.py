"""MAVLink 2 for ground stations and scripts: QGroundControl, Mission Planner, MAVProxy, MAVSDK."""

import imc
from mavlink import KINDS, load_dialect, system_of
from runtime import consume
from tasks.transports.mavlink_protocol.cameras import find_cameras, parse_video
from tasks.transports.mavlink_protocol.ground import GroundLinks
from tasks.transports.mavlink_protocol.named_values import parse_named_value
from tasks.transports.mavlink_protocol.parameters import ParameterTable
from tasks.transports.mavlink_protocol.system import MavlinkSystem


class MAVLink(GroundLinks):
    """MAVLink 2 over UDP, TCP and serial lines: telemetry, commands and parameters, with a flavor for each link."""

    def make_autopilot(self) -> MavlinkSystem:
        """The vehicle that stations see."""
        logs = self.vehicle.log_root / self.system_name
        videos = dict(map(parse_video, self.video_streams))
        mounted = find_cameras(self.vehicle.tasks, logs, videos, lambda: self.detection_markers)
        return MavlinkSystem(
            load_dialect(),
            name=self.system_name,
            system=self.system_id or system_of(self.system),
            kind=KINDS[self.vehicle_kind],
            boot=self.vehicle.start_time,
            undulation=self.geoid_undulation,
            rates=lambda: self.rates,
            parameters=ParameterTable(self.vehicle.tasks),
            entities=lambda: (e for e in self.vehicle.entities if e.component != self.name),
            imc_id=self.system,
            publish=lambda message: self.publish(message),  # noqa: PLW0108, a fault may stand before it later
            folders={"logs": logs, "@MAV_LOG": logs},
            set_parameter=self.ask_for,
            say=self.say,
            speed=lambda: self.hold_speed,
            hold_radius=lambda: self.hold_radius,
            takeoff_altitude=lambda: self.takeoff_altitude,
            reach=self.reach,
            named_values=[parse_named_value(text) for text in self.named_values],
            cameras=mounted if self.cameras else (),
            most=self.most,
            switches=(self.relays, self.lights, self.buttons),
        )

    @consume(others=True)
    def meet_vehicle(self, other: imc.Announce) -> None:
        if other.src != self.system:
            self.twins.meet(other, self.now)

    @consume
    def settle(self, reply: imc.PlanControl | imc.PlanDB) -> None:
        """Take an answer to what a ground station has asked for."""
        if self.is_answered_by(reply):
            self.autopilot.helm.hear(reply)
            self.show_changes()
        elif isinstance(reply, imc.PlanDB):
            self.autopilot.mission.hear_database(reply, self.now)

    @consume
    def recall(self, database: imc.PlanDBState) -> None:
        """Show the mission that was uploaded before the vehicle or this task has restarted."""
        names = {info.plan_id for info in database.plans_info if isinstance(info, imc.PlanDBInformation)}
        self.autopilot.mission.recall(names, self.now)
