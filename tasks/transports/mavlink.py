"""MAVLink 2 for ground stations and scripts: QGroundControl, Mission Planner, MAVProxy, MAVSDK."""

import imc
from mavlink import KINDS, load_dialect, mavlink_system_id
from mavlink.vehicle import VehicleEndpoint, VehicleEquipment, VehicleIdentity, VehicleModel
from mavlink.vehicle.camera import parse_video
from mavlink.vehicle.command import RelayNames
from runtime import consume, periodic
from tasks.transports.mavlink_links.disk_usage_and_thumbnails import DiskPictures
from tasks.transports.mavlink_links.ftp_folders import DiskFolders
from tasks.transports.mavlink_links.ground_links import GroundLinksTask
from tasks.transports.mavlink_links.parameters_and_cameras import find_cameras, task_parameters


class MAVLink(GroundLinksTask):
    """MAVLink 2 over UDP, TCP and serial lines: telemetry, commands and parameters, with a flavor for each link."""

    def make_endpoint(self) -> VehicleEndpoint:
        """The vehicle that stations see."""
        identity = VehicleIdentity(
            self.system_name,
            self.system_id or mavlink_system_id(self.system),
            KINDS[self.vehicle_kind],
            self.vehicle.start_time,
            self.geoid_undulation,
        )
        own = self.name
        model = VehicleModel(identity, self, self, lambda: (e for e in self.vehicle.entities if e.component != own))
        logs = self.vehicle.log_root / self.system_name
        equipment = VehicleEquipment(
            task_parameters(self.vehicle.tasks),
            DiskFolders({"logs": logs, "@MAV_LOG": logs}),
            DiskPictures(logs, self.offload),
            find_cameras(self.vehicle.tasks, dict(map(parse_video, self.video_streams))) if self.cameras else (),
            self.parse_named_values(),
            RelayNames(self.relays, self.lights, self.buttons),
        )
        return VehicleEndpoint(load_dialect(), model, self, equipment, warn=self.log.warning)

    def start(self) -> None:
        self._had_stations = False
        super().start()

    @periodic(1.0)
    def publish_stations_in_reach(self) -> None:
        """Publish the ground stations in reach, and once that there are none."""
        stations = self.endpoint.stations.announcements(self.clock_speed)
        if stations or self._had_stations:
            self.publish(imc.VehicleLinks(localname=self.system_name, links=stations))
        self._had_stations = bool(stations)

    @consume(others=True)
    def check_id_conflict(self, other: imc.Announce) -> None:
        if other.src != self.system:
            self.endpoint.id_conflicts.on_announce(other, self.now)

    @consume
    def on_plan_reply(self, reply: imc.PlanControl | imc.PlanDB) -> None:
        """Take an answer to what a ground station has asked for."""
        if self.is_reply_to_me(reply):
            self.endpoint.receive_reply(reply, self.now)
        elif isinstance(reply, imc.PlanDB):
            self.endpoint.mission.on_plan_db(reply, self.now)

    @consume
    def restore_uploaded_mission(self, database: imc.PlanDBState) -> None:
        """Show the mission that was uploaded before the vehicle or this task has restarted."""
        names = {info.plan_id for info in database.plans_info if isinstance(info, imc.PlanDBInformation)}
        self.endpoint.mission.restore(names, self.now)
