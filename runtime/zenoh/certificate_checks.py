"""Checks certificates and the rights of secret files, since zenoh does not report them."""

import stat
from pathlib import Path


def certificate_problem(root: Path, certificate: Path, key: Path, *, of_client: bool = False) -> str:
    """Reason why peers that trust an authority reject a certificate, "" if they accept it: found by a handshake.

    It is that of a server, to which they connect, or of a client, as mTLS asks for; each needs its extendedKeyUsage.
    """
    import ssl  # slow to import, and only here

    server, client = ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER), ssl.SSLContext(ssl.PROTOCOL_TLS_CLIENT)
    client.check_hostname = False  # of the addresses at which it is used only clients know
    judge, other = (server, client) if of_client else (client, server)
    judge.verify_mode, other.verify_mode = ssl.CERT_REQUIRED, ssl.CERT_NONE
    there, back = ssl.MemoryBIO(), ssl.MemoryBIO()
    try:
        for end in (server, client):
            end.load_cert_chain(certificate, key, password="")  # without one it would ask at the terminal
        judge.load_verify_locations(root)
        asking, answering = client.wrap_bio(there, back), server.wrap_bio(back, there, server_side=True)
        for end in (asking, answering, asking, answering):
            try:
                end.do_handshake()
            except ssl.SSLWantReadError:
                continue
    except ssl.SSLCertVerificationError as error:
        if "purpose" in error.verify_message:
            return f"its extendedKeyUsage has no {'clientAuth' if of_client else 'serverAuth'}"
        return error.verify_message
    except (ssl.SSLError, OSError) as error:
        return error.strerror or str(error)
    return ""


def is_world_accessible(path: Path) -> bool:
    """Whether each user of this computer can read or write a file."""
    try:
        return bool(path.stat().st_mode & (stat.S_IROTH | stat.S_IWOTH))
    except OSError:
        return False
