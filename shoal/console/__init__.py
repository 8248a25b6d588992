"""The page in the browser: where vehicles are, how they are, and orders to them."""

from shoal.console.access import Access, LoginError
from shoal.console.server import ConsoleServer
from shoal.console.tiles import TileSets

__all__ = ["Access", "ConsoleServer", "LoginError", "TileSets"]
