"""The page in the browser: where vehicles are, how they are, and orders to them."""

from shoal.console.access.authority import Authority, AuthorityError
from shoal.console.access.certificate import CERTIFICATE, certificate_names, make_certificate, own_names
from shoal.console.access.client_certificate import ClientCertificate, make_client_certificate
from shoal.console.access.lease import LeaseError, Leases
from shoal.console.access.page_security import PageSecurity, PageSecurityError, access_folder, read_page_security
from shoal.console.access.page_sessions import Access, LoginError, PageSession
from shoal.console.access.users import Role, User, Users, UsersError
from shoal.console.bus_link import BusLink
from shoal.console.charts.chart_import import ChartImportError, ImportedChart, import_chart
from shoal.console.charts.chart_overlays import SUFFIX as OVERLAY_SUFFIX
from shoal.console.charts.tiles import TileSets
from shoal.console.logs.log_link import LogLink
from shoal.console.panels.user_panels import PanelFileError, read_panels
from shoal.console.parameters.profile_settings import ProfileSettings
from shoal.console.server import ConsoleServer
from shoal.console.vehicle_page import VehiclePage

__all__ = [
    "CERTIFICATE",
    "OVERLAY_SUFFIX",
    "Access",
    "Authority",
    "AuthorityError",
    "BusLink",
    "ChartImportError",
    "ClientCertificate",
    "ConsoleServer",
    "ImportedChart",
    "LeaseError",
    "Leases",
    "LogLink",
    "LoginError",
    "PageSecurity",
    "PageSecurityError",
    "PageSession",
    "PanelFileError",
    "ProfileSettings",
    "Role",
    "TileSets",
    "User",
    "Users",
    "UsersError",
    "VehiclePage",
    "access_folder",
    "certificate_names",
    "import_chart",
    "make_certificate",
    "make_client_certificate",
    "own_names",
    "read_page_security",
    "read_panels",
]
