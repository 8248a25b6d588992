"""A certificate for the page that its own key has signed."""

import datetime
import re
import socket
from collections.abc import Iterable
from ipaddress import ip_address
from pathlib import Path
from typing import TYPE_CHECKING

from runtime.network_interfaces import interfaces
from support.atomic_files import write_file
from support.terminal_text import quoted

if TYPE_CHECKING:
    from cryptography import x509
    from cryptography.hazmat.primitives.asymmetric.ec import EllipticCurvePrivateKey

LABEL = r"[A-Za-z0-9_](?:[A-Za-z0-9_-]{0,61}[A-Za-z0-9])?"
NAME = re.compile(rf"(?=.{{1,253}}$){LABEL}(?:\.{LABEL})*")
CERTIFICATE, KEY = "certificate.pem", "key.pem"
LIFETIME = datetime.timedelta(days=825)  # the longest that Apple's browsers accept
CLOCK_ERROR = datetime.timedelta(days=1)  # a vehicle may not know the time
PUBLIC, PRIVATE = 0o644, 0o600


def own_names() -> list[str]:
    """The names and IPv4 addresses of this computer, loopback last."""
    name = socket.gethostname()
    local = [] if "." in name else [f"{name}.local"]
    addresses = [each.address for each in interfaces() if not each.is_loopback]
    return list(dict.fromkeys([*addresses, name, *local, "localhost", "127.0.0.1"]))


def make_certificate(folder: Path, names: Iterable[str]) -> str:
    """Write certificate.pem and key.pem for some names and addresses; returns the SHA-256 that browsers show.

    Raises ValueError for a name that is none, OSError.
    """
    from cryptography import x509  # large, and not needed on the loopback address
    from cryptography.hazmat.primitives import hashes
    from cryptography.hazmat.primitives.asymmetric import ec
    from cryptography.x509.oid import ExtendedKeyUsageOID, NameOID

    named = list(names)
    key = ec.generate_private_key(ec.SECP256R1())
    now = datetime.datetime.now(datetime.UTC)
    subject = x509.Name([x509.NameAttribute(NameOID.COMMON_NAME, named[0][:64])])
    usage = x509.KeyUsage(
        digital_signature=True,
        content_commitment=False,
        key_encipherment=False,
        data_encipherment=False,
        key_agreement=False,
        key_cert_sign=False,
        crl_sign=False,
        encipher_only=False,
        decipher_only=False,
    )
    made = (
        x509.CertificateBuilder()
        .subject_name(subject)
        .issuer_name(subject)
        .public_key(key.public_key())
        .serial_number(x509.random_serial_number())
        .not_valid_before(now - CLOCK_ERROR)
        .not_valid_after(now + LIFETIME)
        .add_extension(x509.SubjectAlternativeName([_general_name(name) for name in named]), critical=False)
        .add_extension(x509.BasicConstraints(ca=False, path_length=None), critical=True)
        .add_extension(usage, critical=True)
        .add_extension(x509.ExtendedKeyUsage([ExtendedKeyUsageOID.SERVER_AUTH]), critical=False)
        .sign(key, hashes.SHA256())
    )
    write_certificate(folder / CERTIFICATE, made, folder / KEY, key)
    return made.fingerprint(hashes.SHA256()).hex(":").upper()


def write_certificate(
    path: Path, certificate: "x509.Certificate", key_path: Path, key: "EllipticCurvePrivateKey"
) -> None:
    """Write a certificate, and its key, which only this user may read. Raises OSError."""
    from cryptography.hazmat.primitives.serialization import Encoding, NoEncryption, PrivateFormat

    write_file(key_path, key.private_bytes(Encoding.PEM, PrivateFormat.PKCS8, NoEncryption()), PRIVATE)
    write_file(path, certificate.public_bytes(Encoding.PEM), PUBLIC)


def certificate_names(path: Path) -> list[str]:
    """The names and addresses of computers in a certificate. Raises ValueError, OSError."""
    from cryptography import x509

    found = x509.load_pem_x509_certificate(path.read_bytes())
    try:
        names = found.extensions.get_extension_for_class(x509.SubjectAlternativeName).value
    except x509.ExtensionNotFound:
        return []
    return [*names.get_values_for_type(x509.DNSName), *map(str, names.get_values_for_type(x509.IPAddress))]


def _general_name(name: str) -> "x509.GeneralName":
    from cryptography import x509

    try:
        return x509.IPAddress(ip_address(name))
    except ValueError:
        if not NAME.fullmatch(name):
            raise ValueError(f"{quoted(name)} is neither the name nor the address of a computer") from None
        return x509.DNSName(name)
