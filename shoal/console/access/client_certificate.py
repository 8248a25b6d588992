"""Certificates with which users log in to the page, signed by an authority that is only for this page."""

import datetime
import secrets
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from shoal.console.access.certificate import CLOCK_ERROR, LIFETIME, PRIVATE, write_certificate
from shoal.console.access.users import Role, Users, UsersError
from support.atomic_files import write_file

if TYPE_CHECKING:
    from cryptography import x509
    from cryptography.hazmat.primitives.asymmetric.ec import EllipticCurvePrivateKey

AUTHORITY, AUTHORITY_KEY = "client-authority.pem", "client-authority-key.pem"
AUTHORITY_LIFETIME = datetime.timedelta(days=3650)
AUTHORITY_NAME = "Shoal page clients"


@dataclass(frozen=True)
class ClientCertificate:
    """A certificate and its key in a PKCS #12 file, which the password opens.

    `is_first` is whether its authority was made, too.
    """

    path: Path
    password: str
    is_first: bool


def make_client_certificate(folder: Path, name: str, role: Role, *, replaces: bool = False) -> ClientCertificate:
    """Write NAME.p12 into a folder, and let this certificate log in the user, who is added if needed.

    Raises UsersError for a user that cannot be one, and if the file is there and is not replaced; ValueError for an
    authority that cannot be read; OSError.
    """
    from cryptography import x509
    from cryptography.hazmat.primitives import hashes
    from cryptography.hazmat.primitives.asymmetric import ec
    from cryptography.hazmat.primitives.serialization import BestAvailableEncryption, pkcs12
    from cryptography.x509.oid import ExtendedKeyUsageOID

    users = Users(folder)
    users.check_name(name)
    path = folder / f"{name}.p12"
    if path.exists() and not replaces:
        raise UsersError(f"{path} is there: --force replaces it; its certificate holds until the user is removed")
    is_first = not (folder / AUTHORITY).exists()
    authority, authority_key = _make_authority(folder) if is_first else _read_authority(folder)
    key = ec.generate_private_key(ec.SECP256R1())
    made = (
        _builder(name, key, LIFETIME)
        .issuer_name(authority.subject)
        .add_extension(x509.BasicConstraints(ca=False, path_length=None), critical=True)
        .add_extension(x509.ExtendedKeyUsage([ExtendedKeyUsageOID.CLIENT_AUTH]), critical=False)
        .sign(authority_key, hashes.SHA256())
    )
    password = secrets.token_urlsafe(12)
    protection = BestAvailableEncryption(password.encode())
    packed = pkcs12.serialize_key_and_certificates(name.encode(), key, made, [authority], protection)
    users.add_certificate(name, role, made.fingerprint(hashes.SHA256()).hex())  # before a file is replaced
    write_file(path, packed, PRIVATE)
    return ClientCertificate(path, password, is_first)


def _make_authority(folder: Path) -> "tuple[x509.Certificate, EllipticCurvePrivateKey]":
    from cryptography import x509
    from cryptography.hazmat.primitives import hashes
    from cryptography.hazmat.primitives.asymmetric import ec

    key = ec.generate_private_key(ec.SECP256R1())
    builder = _builder(AUTHORITY_NAME, key, AUTHORITY_LIFETIME)
    made = (
        builder.issuer_name(_name(AUTHORITY_NAME))
        .add_extension(x509.BasicConstraints(ca=True, path_length=0), critical=True)
        .sign(key, hashes.SHA256())
    )
    write_certificate(folder / AUTHORITY, made, folder / AUTHORITY_KEY, key)
    return made, key


def _read_authority(folder: Path) -> "tuple[x509.Certificate, EllipticCurvePrivateKey]":
    """Raises ValueError, OSError."""
    from cryptography import x509
    from cryptography.hazmat.primitives.asymmetric import ec
    from cryptography.hazmat.primitives.serialization import load_pem_private_key

    try:
        found = x509.load_pem_x509_certificate((folder / AUTHORITY).read_bytes())
        key = load_pem_private_key((folder / AUTHORITY_KEY).read_bytes(), None)
    except ValueError as error:
        raise ValueError(f"{folder / AUTHORITY}: not a certificate with its key: {error}") from None
    if not isinstance(key, ec.EllipticCurvePrivateKey) or key.public_key() != found.public_key():
        raise ValueError(f"{folder / AUTHORITY}: not the certificate of {folder / AUTHORITY_KEY}")
    return found, key


def _builder(name: str, key: "EllipticCurvePrivateKey", lifetime: datetime.timedelta) -> "x509.CertificateBuilder":
    from cryptography import x509

    now = datetime.datetime.now(datetime.UTC)
    return (
        x509.CertificateBuilder()
        .subject_name(_name(name))
        .public_key(key.public_key())
        .serial_number(x509.random_serial_number())
        .not_valid_before(now - CLOCK_ERROR)
        .not_valid_after(now + lifetime)
    )


def _name(name: str) -> "x509.Name":
    from cryptography import x509
    from cryptography.x509.oid import NameOID

    return x509.Name([x509.NameAttribute(NameOID.COMMON_NAME, name)])
