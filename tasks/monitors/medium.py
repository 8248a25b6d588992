"""Estimates the medium that the vehicle is in."""

import math
from typing import ClassVar

import imc
from runtime import State, Task, consume, param, periodic
from runtime.vehicle import general_number

Where = imc.VehicleMedium.Medium
BOATS = ("USV", "ASV")  # DUNE writes ASV
KINDS = ("UUV", *BOATS, "UAV", "UGV")
VALID_POS = imc.GpsFix.Validity.VALID_POS.value


class Medium(Task):
    """Finds the medium of an AUV from its depth and wet sensors, of a UAV from its speed and altitude.

    An AUV near the surface without wet sensors is assumed to float.
    """

    active: bool = param(True, "", "Publish the medium.", scope="idle", visibility="developer")
    activation: ClassVar[str] = "idle"
    execution_frequency: float = param(1.0, "Hz", "Rate of VehicleMedium.", minimum=0.001, maximum=1000)
    vehicle_type: str = param("UUV", "", "Kind of vehicle.", choices=KINDS, editable=False)
    initialization_time: float = param(20.0, "s", "Without data, the medium is unknown for this time.", minimum=0)
    wet_data_timeout: float = param(3.0, "s", "Longest age of a wet sensor's sample.", minimum=0.1)
    gps_timeout: float = param(2.0, "s", "Longest age of a GPS fix.", name="GPS Timeout", minimum=0.1)
    sound_speed_threshold: float = param(1000.0, "m/s", "A higher speed of sound means water.", minimum=0)
    salinity_threshold: float = param(1.0, "PSU", "A higher salinity means water.", minimum=0)
    air_speed_threshold: float = param(12.0, "m/s", "A faster aircraft is in the air.", minimum=0)
    altitude_threshold: float = param(1.0, "m", "A higher aircraft is in the air.")

    def configure(self) -> None:
        self._deepest_float = general_number(self.vehicle.profile, "Underwater Depth Threshold", 0.3)

    def start(self) -> None:
        self._began = self.now
        self._fix = self._wet_data = -math.inf
        self._wet = False
        self._state: imc.EstimatedState | None = None
        self.set_entity_state(State.NORMAL, "active")

    @consume
    def on_estimated_state(self, state: imc.EstimatedState) -> None:
        self._state = state

    @consume
    def on_gps_fix(self, fix: imc.GpsFix) -> None:
        if fix.validity & VALID_POS:
            self._fix = self.now

    @consume
    def on_water_sample(self, sample: imc.SoundSpeed | imc.Salinity) -> None:
        """Ignore negative values, which mean that the sensor has no sample."""
        if sample.value < 0.0:
            return
        limit = self.sound_speed_threshold if isinstance(sample, imc.SoundSpeed) else self.salinity_threshold
        self._wet, self._wet_data = sample.value > limit, self.now

    @periodic("execution_frequency")
    def publish_medium(self) -> None:
        if self.active:
            self.publish(imc.VehicleMedium(medium=self._medium()))

    def _medium(self) -> Where:
        state = self._state
        if self.vehicle_type == "UGV":
            return Where.GROUND
        if self.vehicle_type in BOATS:
            return Where.WATER
        if state is None:
            return Where.UNKNOWN
        if self.vehicle_type == "UAV":
            speed = math.hypot(state.vx, state.vy, state.vz)
            return (
                Where.AIR if speed > self.air_speed_threshold or state.alt > self.altitude_threshold else Where.GROUND
            )
        if state.depth > self._deepest_float:
            return Where.UNDERWATER
        known = self.age(self._wet_data) <= self.wet_data_timeout
        if known and not self._wet:
            return Where.GROUND
        if known or self.age(self._fix) <= self.gps_timeout or self.age(self._began) >= self.initialization_time:
            return Where.WATER
        return Where.UNKNOWN
