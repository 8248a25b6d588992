"""MAVLink messages and the records of autopilots' logs as IMC, and IMC values as MAVLink fields."""

from mavlink.translate import cameras_from_imc, from_imc, sensors_from_imc
from mavlink.translate.autopilot import AutopilotTranslator
from mavlink.translate.dataflash import DataFlashTranslator, survey_dataflash
from mavlink.translate.telemetry_values import ENTITIES, LoggedFlight
from mavlink.translate.transactions import TransactionTranslator
from mavlink.translate.ulog import ULogTranslator, survey_ulog

__all__ = [
    "ENTITIES",
    "AutopilotTranslator",
    "DataFlashTranslator",
    "LoggedFlight",
    "TransactionTranslator",
    "ULogTranslator",
    "cameras_from_imc",
    "from_imc",
    "sensors_from_imc",
    "survey_dataflash",
    "survey_ulog",
]
