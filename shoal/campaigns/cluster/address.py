"""Addresses of clusters, as users write them."""

from urllib.parse import urlsplit

PORT = 8786
_KINDS = {"dask": "tcp", "dask+tls": "tls"}


def to_dask_address(text: str) -> str:
    """Dask's address of a scheduler: tcp://host:8786 for dask://host:8786 or dask://host, tls:// for dask+tls://.

    Raises ValueError.
    """
    kind, _, place = text.partition("://")
    try:
        parts = urlsplit(f"//{place}")
        host, port, more = parts.hostname, parts.port or PORT, parts.path.strip("/") or parts.query or parts.username
    except ValueError:
        host, port, more = None, PORT, None
    if kind not in _KINDS or not host or more:
        raise ValueError(f"{text!r} is not a cluster address such as dask://scheduler:{PORT}")
    return f"{_KINDS[kind]}://{f'[{host}]' if ':' in host else host}:{port}"
