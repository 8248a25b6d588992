"""Checks certificates and the rights of secret files, since zenoh says nothing of them."""

import stat
from pathlib import Path


def refusal(root: Path, certificate: Path, key: Path) -> str:
    """Why those who trust an authority refuse a certificate, "" if they accept it: found by a handshake with itself."""
    import ssl  # slow to import, and only here

    server, client = ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER), ssl.SSLContext(ssl.PROTOCOL_TLS_CLIENT)
    client.check_hostname = False  # of the addresses at which it is used only others know
    there, back = ssl.MemoryBIO(), ssl.MemoryBIO()
    try:
        server.load_cert_chain(certificate, key, password="")  # without one it would ask at the terminal
        client.load_verify_locations(root)
        asking, answering = client.wrap_bio(there, back), server.wrap_bio(back, there, server_side=True)
        for end in (asking, answering, asking):
            try:
                end.do_handshake()
            except ssl.SSLWantReadError:
                continue
    except ssl.SSLCertVerificationError as error:
        return error.verify_message
    except (ssl.SSLError, OSError) as error:
        return error.strerror or str(error)
    return ""


def open_to_all(path: Path) -> bool:
    """Whether each user of this computer can read or write a file."""
    try:
        return bool(path.stat().st_mode & (stat.S_IROTH | stat.S_IWOTH))
    except OSError:
        return False
