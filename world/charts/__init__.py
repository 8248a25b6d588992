"""Charts: depths of the sea in GeoTIFF, NetCDF, ESRI grids and text, around the origin of a world."""

from world.charts.chart import FORMATS, POSITIVE, Chart, find_chart_suffix, read_chart
from world.charts.chart_window import ChartWindow
from world.charts.coordinates import Coordinates, parse_coordinates

__all__ = [
    "FORMATS",
    "POSITIVE",
    "Chart",
    "ChartWindow",
    "Coordinates",
    "find_chart_suffix",
    "parse_coordinates",
    "read_chart",
]
