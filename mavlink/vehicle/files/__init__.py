"""The files and logs that stations read, by MAVLink FTP and by the older log messages."""

from mavlink.vehicle.files.file_and_log_transfer import FileAndLogTransfer
from mavlink.vehicle.files.ftp_messages import checksum
from mavlink.vehicle.files.virtual_files import LARGEST_FILE, VirtualFiles, no_such_file

__all__ = ["LARGEST_FILE", "FileAndLogTransfer", "VirtualFiles", "checksum", "no_such_file"]
