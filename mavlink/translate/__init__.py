"""MAVLink messages and the records of autopilots' logs as IMC, and IMC values as MAVLink fields."""

from mavlink.translate import cameras_from_imc, from_imc, sensors_from_imc
from mavlink.translate.autopilot import AutopilotTranslator
from mavlink.translate.dataflash import DataFlashTranslator, scan_dataflash
from mavlink.translate.measurements_to_imc import ENTITIES, LoggedFlight
from mavlink.translate.missions_and_commands_to_imc import TransactionTranslator
from mavlink.translate.ulog import ULogTranslator, scan_ulog

__all__ = [
    "ENTITIES",
    "AutopilotTranslator",
    "DataFlashTranslator",
    "LoggedFlight",
    "TransactionTranslator",
    "ULogTranslator",
    "cameras_from_imc",
    "from_imc",
    "scan_dataflash",
    "scan_ulog",
    "sensors_from_imc",
]
