"""Follows a path of points."""

import imc
from support.planar_geometry import remaining_distances
from support.wgs84 import displace
from tasks.maneuver.maneuver_task import Maneuver, ManeuverError, PathEnd


class FollowPath(Maneuver):
    """Goes through points given as offsets (m) from a position; done near the last."""

    async def execute(self, path: imc.FollowPath) -> None:
        points = [point for point in path.points if isinstance(point, imc.PathPoint)]
        if not points:
            raise ManeuverError("path has no points")
        leg = PathEnd.from_maneuver(path)
        left = remaining_distances([(point.x, point.y) for point in points])
        for number, point in enumerate(points):
            lat, lon, _ = displace(path.lat, path.lon, 0.0, point.x, point.y)
            end = leg._replace(lat=lat, lon=lon, z=path.z + point.z)
            await self.go_to_end(end, info=f"waypoint={number}", after=leg.duration(left[number]))
