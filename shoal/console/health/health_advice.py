"""Advice to an operator about an entity that is not in order, by its own description."""

import re

import imc

State = imc.EntityState.State
RULES: tuple[tuple[str, str], ...] = (
    (r"^no report for|falls? silent|^silent", "Its task is silent: read its lines in the log book. A computer that is "
     "overloaded delays all tasks: compare CpuUsage in Plots."),
    (r"\bleak", "Abort, recover the vehicle, and open it when it is dry."),
    (r"fuel|battery|reserve", "End the plan and recover the vehicle, or change the battery."),
    (r"disk|no space|storage", "Download old logs and remove them: without space nothing is recorded."),
    (r"processor", "Stop other programs on the vehicle's computer, or lower the rates of its tasks."),
    (r"\bGPS\b|\bfix(es)?\b", "Bring the antenna out of the water under a free sky and wait a minute; compare "
     "GpsFix.satellites in Plots."),
    (r"violates", "The vehicle is beyond a limit: bring it back, or change the limit in Parameters."),
    (r"servo|fin", "Look for weed or ice, and compare SetServoPosition with ServoPosition in Plots."),
    (r"obstacle", "Bring the vehicle away from it, or plan a way around."),
    (r"refused|unreachable|no route|connecting|no such (file|device)|disconnected|permission", "Check power, cable and "
     "address of the device; its options are in Parameters."),
    (r"missing|timed? ?out|no recent|^no [A-Z]", "A message that it needs does not arrive: find its sender in the "
     "table of rates in Plots."),
    (r"drift|jump|stuck|impossible|does not follow|contradict", "Its values are wrong: draw them in Plots, compare "
     "them with another sensor, and calibrate or change it."),
    (r"restarting|\w(Error|Exception)\b", "Its task has failed and starts again: the log of the vehicle has the "
     "traceback."),
)  # fmt: skip
STARTING = "It is starting. If it stays so, read its lines in the log book."
GENERAL = "Read its lines in the log book; its options are in Parameters."


def advice(state: int, description: str) -> str:
    """A sentence for the operator; empty for an entity that is in order."""
    if state == State.NORMAL:
        return ""
    if state == State.BOOT:
        return STARTING
    return next((text for rule, text in RULES if re.search(rule, description, re.IGNORECASE)), GENERAL)
