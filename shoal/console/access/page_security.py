"""Security of the page: the loopback address, or another one with users and TLS."""

import ssl
from collections.abc import Collection
from dataclasses import dataclass
from ipaddress import IPv4Address, ip_address
from pathlib import Path

from runtime.network_interfaces import is_loopback_address, is_loopback_host
from shoal.console.access.certificate import CERTIFICATE, KEY, certificate_names, own_names
from shoal.console.access.client_certificate import AUTHORITY
from shoal.console.access.users import Users, UsersError
from support.regular_files import check_regular_file
from support.user_folders import config_folder

LOOPBACK = "127.0.0.1"
ANY = IPv4Address("0.0.0.0")


class PageSecurityError(ValueError):
    """A page that must not be served so; the text names what to do."""


@dataclass(frozen=True)
class PageSecurity:
    """Address, users and certificate of a page; `hosts` are its names in a browser, the first one for links.

    `client_authority` is the certificate that has signed those of clients. `notice` is a sentence for the operator.
    """

    address: str = LOOPBACK
    users: Users | None = None
    certificate: Path | None = None
    key: Path | None = None
    client_authority: Path | None = None
    notice: str = ""
    hosts: tuple[str, ...] = (LOOPBACK, "localhost")

    @property
    def is_open(self) -> bool:
        """Whether other computers reach the page."""
        return self.certificate is not None

    @property
    def scheme(self) -> str:
        return "https" if self.is_open else "http"


def access_folder() -> Path:
    """The folder with users and certificate of the pages of this user."""
    return config_folder() / "console"


def read_page_security(address: str, folder: Path) -> PageSecurity:
    """The security of a page at an IPv4 address, by the files in a folder.

    At any address but loopback users and a certificate are needed. Raises PageSecurityError with the commands that make
    what is missing, and for files that cannot be used; OSError.
    """
    try:
        users = Users(folder)
    except UsersError as error:
        raise PageSecurityError(str(error)) from None
    if is_loopback_address(address):
        return PageSecurity(address, users, hosts=tuple(dict.fromkeys((address, LOOPBACK, "localhost"))))
    certificate, key = folder / CERTIFICATE, folder / KEY
    where = "" if folder == access_folder() else f" --folder {folder}"
    missing = [] if users else [f"shoal console user NAME --role operate{where}"]
    if not (certificate.exists() and key.exists()):
        missing.append(f"shoal console certificate{where}")
    if missing:
        raise PageSecurityError(
            f"the page is not served at {address}, where other computers reach it, without users and TLS: "
            f"{' and '.join(missing)}"
        )
    authority = folder / AUTHORITY
    for path in (certificate, key, *([authority] if authority.exists() else [])):
        check_regular_file(path)
    try:
        ssl.create_default_context(ssl.Purpose.CLIENT_AUTH).load_cert_chain(certificate, key)
        names = certificate_names(certificate)
    except (ssl.SSLError, ValueError) as error:
        raise PageSecurityError(f"{certificate}: not the certificate of {key}: {error}") from None
    if not names:
        raise PageSecurityError(f"{certificate}: it names no computer: shoal console certificate{where}")
    first = [name for name in names if name == address]
    hosts = tuple(dict.fromkeys((*first, *names, LOOPBACK, "localhost")))
    notice = _missing_address(address, names, f"shoal console certificate --force{where}")
    return PageSecurity(address, users, certificate, key, authority if authority.exists() else None, notice, hosts)


def _missing_address(address: str, names: Collection[str], command: str) -> str:
    """Name the addresses of the page that its certificate lacks, whose requests are rejected; empty if it names one."""
    own = [address] if ip_address(address) != ANY else [name for name in own_names() if not is_loopback_host(name)]
    if any(name in names for name in own):
        return ""
    return f"the certificate of the page names none of {', '.join(own)}: browsers do not reach it there: {command}"
