"""The messages of IMC 5.4.31 and of Shoal: written by `python -m imc.generate` from imc/definitions."""

from enum import IntEnum, IntFlag
from typing import ClassVar

from imc.message import Message, MessageWithLists


class Boolean(IntEnum):
    """Boolean Value."""

    FALSE = 0
    TRUE = 1


class ControlledMode(IntEnum):
    """Controlled Mode."""

    RELINQUISH_HANDOFF_CTL = 0
    REQUEST_CTL = 1
    OVERRIDE_CTL = 2


class SpeedUnits(IntEnum):
    """Speed Units."""

    METERS_PS = 0
    RPM = 1
    PERCENTAGE = 2


class SystemType(IntEnum):
    """System Type."""

    CCU = 0
    HUMANSENSOR = 1
    UUV = 2
    USV = 3
    UAV = 4
    UGV = 5
    STATICSENSOR = 6
    MOBILESENSOR = 7
    WSN = 8


class ZUnits(IntEnum):
    """Z Units."""

    NONE = 0
    DEPTH = 1
    ALTITUDE = 2
    HEIGHT = 3


class RSSIUnits(IntEnum):
    """RSSI Units."""

    dB = 0
    PERCENTAGE = 1


class UAVType(IntEnum):
    """UAV Type."""

    FIXEDWING = 0
    COPTER = 1
    VTOL = 2


class CLoopsMask(IntFlag):
    """Control Loops Mask."""

    NONE = 0x00000000
    PATH = 0x00000001
    TELEOPERATION = 0x00000002
    ALTITUDE = 0x00000004
    DEPTH = 0x00000008
    ROLL = 0x00000010
    PITCH = 0x00000020
    YAW = 0x00000040
    SPEED = 0x00000080
    YAW_RATE = 0x00000100
    VERTICAL_RATE = 0x00000200
    TORQUE = 0x00000400
    FORCE = 0x00000800
    VELOCITY = 0x00001000
    THROTTLE = 0x00002000
    EXTERNAL = 0x40000000
    NO_OVERRIDE = 0x80000000
    ALL = 0xFFFFFFFF


class OpLimitsMask(IntFlag):
    """Operational Limits Mask."""

    MAX_DEPTH = 0x01
    MIN_ALT = 0x02
    MAX_ALT = 0x04
    MIN_SPEED = 0x08
    MAX_SPEED = 0x10
    MAX_VRATE = 0x20
    AREA = 0x40


class EntityState(Message, frozen=True):
    """Entity State."""

    ID: ClassVar[int] = 1
    WIRE: ClassVar[str] = "BBT"

    class State(IntEnum):
        BOOT = 0
        NORMAL = 1
        FAULT = 2
        ERROR = 3
        FAILURE = 4

    class Flags(IntFlag):
        HUMAN_INTERVENTION = 0x1

    state: int = 0  # uint8, State
    flags: int = 0  # uint8, Flags
    description: str = ""  # plaintext


class QueryEntityState(Message, frozen=True):
    """Query Entity State."""

    ID: ClassVar[int] = 2


class EntityInfo(Message, frozen=True):
    """Entity Information."""

    ID: ClassVar[int] = 3
    WIRE: ClassVar[str] = "BTTHH"

    id: int = 0  # uint8
    label: str = ""  # plaintext
    component: str = ""  # plaintext
    act_time: int = 0  # s, uint16
    deact_time: int = 0  # s, uint16


class QueryEntityInfo(Message, frozen=True):
    """Query Entity Information."""

    ID: ClassVar[int] = 4
    WIRE: ClassVar[str] = "B"

    id: int = 0  # uint8


class EntityList(Message, frozen=True):
    """Entity List."""

    ID: ClassVar[int] = 5
    WIRE: ClassVar[str] = "BT"

    class Op(IntEnum):
        REPORT = 0
        QUERY = 1
        RELOAD = 2

    op: int = 0  # uint8, Op
    list: str = ""  # TupleList, plaintext


class CpuUsage(Message, frozen=True):
    """CPU Usage."""

    ID: ClassVar[int] = 7
    WIRE: ClassVar[str] = "B"

    value: int = 0  # %, uint8, at most 100


class TransportBindings(Message, frozen=True):
    """Transport Bindings."""

    ID: ClassVar[int] = 8
    WIRE: ClassVar[str] = "TH"

    consumer: str = ""  # plaintext
    message_id: int = 0  # uint16


class RestartSystem(Message, frozen=True):
    """Restart System."""

    ID: ClassVar[int] = 9
    WIRE: ClassVar[str] = "B"

    class Type(IntEnum):
        DUNE = 1
        SYSTEM = 2
        TASK = 3

    type: int = 0  # uint8, Type


class DevCalibrationControl(Message, frozen=True):
    """Device Calibration Control."""

    ID: ClassVar[int] = 12
    WIRE: ClassVar[str] = "B"

    class Op(IntEnum):
        START = 0
        STOP = 1
        STEP_NEXT = 2
        STEP_PREVIOUS = 3

    op: int = 0  # uint8, Op


class DevCalibrationState(Message, frozen=True):
    """Device Calibration State."""

    ID: ClassVar[int] = 13
    WIRE: ClassVar[str] = "BBTB"

    class Flags(IntFlag):
        PREVIOUS_NOT_SUPPORTED = 0x01
        NEXT_NOT_SUPPORTED = 0x02
        WAITING_CONTROL = 0x04
        ERROR = 0x08
        COMPLETED = 0x10

    total_steps: int = 0  # uint8
    step_number: int = 0  # uint8
    step: str = ""  # plaintext
    flags: int = 0  # uint8, Flags


class EntityActivationState(Message, frozen=True):
    """Entity Activation State."""

    ID: ClassVar[int] = 14
    WIRE: ClassVar[str] = "BT"

    class State(IntEnum):
        INACTIVE = 0
        ACTIVE = 1
        ACT_IP = 2
        ACT_DONE = 3
        ACT_FAIL = 4
        DEACT_IP = 5
        DEACT_DONE = 6
        DEACT_FAIL = 7

    state: int = 0  # uint8, State
    error: str = ""  # plaintext


class QueryEntityActivationState(Message, frozen=True):
    """Query Entity Activation State."""

    ID: ClassVar[int] = 15


class VehicleOperationalLimits(Message, frozen=True):
    """Vehicle Operational Limits."""

    ID: ClassVar[int] = 16
    WIRE: ClassVar[str] = "Bfffffffffffffffff"

    class Op(IntEnum):
        REQUEST = 0
        SET = 1
        REPORT = 2

    op: int = 0  # uint8, Op
    speed_min: float = 0.0  # m/s, fp32, at least 0
    speed_max: float = 0.0  # m/s, fp32, at least 0
    long_accel: float = 0.0  # m/s/s, fp32, at least 0
    alt_max_msl: float = 0.0  # m, fp32, at least 0
    dive_fraction_max: float = 0.0  # fp32, at least 0
    climb_fraction_max: float = 0.0  # fp32, at least 0
    bank_max: float = 0.0  # rad, fp32, at least 0
    p_max: float = 0.0  # rad/s, fp32, at least 0
    pitch_min: float = 0.0  # rad, fp32
    pitch_max: float = 0.0  # rad, fp32
    q_max: float = 0.0  # rad/s, fp32, at least 0
    g_min: float = 0.0  # g, fp32, at most 0
    g_max: float = 0.0  # g, fp32, at least 0
    g_lat_max: float = 0.0  # g, fp32, at least 0
    rpm_min: float = 0.0  # rpm, fp32, at least 0
    rpm_max: float = 0.0  # rpm, fp32, at least 0
    rpm_rate_max: float = 0.0  # rpm/s, fp32, at least 0


class MsgList(MessageWithLists, frozen=True):
    """Message List."""

    ID: ClassVar[int] = 20
    WIRE: ClassVar[str] = "L"
    LISTS: ClassVar[tuple[str, ...]] = ("msgs",)

    msgs: tuple[Message | None, ...] = ()  # message-list


class RamUsage(Message, frozen=True):
    """RAM Usage."""

    ID: ClassVar[int] = 21
    WIRE: ClassVar[str] = "d"

    value: float = 0.0  # KiB, fp64


class SimulatedState(Message, frozen=True):
    """Simulated State."""

    ID: ClassVar[int] = 50
    WIRE: ClassVar[str] = "ddffffffffffffffff"

    lat: float = 0.0  # rad, fp64, -1.5708 to 1.5708
    lon: float = 0.0  # rad, fp64, -3.14159 to 3.14159
    height: float = 0.0  # m, fp32
    x: float = 0.0  # m, fp32
    y: float = 0.0  # m, fp32
    z: float = 0.0  # m, fp32
    phi: float = 0.0  # rad, fp32, -3.14159 to 3.14159
    theta: float = 0.0  # rad, fp32, -1.5708 to 1.5708
    psi: float = 0.0  # rad, fp32, -3.14159 to 3.14159
    u: float = 0.0  # m/s, fp32
    v: float = 0.0  # m/s, fp32
    w: float = 0.0  # m/s, fp32
    p: float = 0.0  # rad/s, fp32, -3.14159 to 3.14159
    q: float = 0.0  # rad/s, fp32, -3.14159 to 3.14159
    r: float = 0.0  # rad/s, fp32, -3.14159 to 3.14159
    svx: float = 0.0  # m/s, fp32
    svy: float = 0.0  # m/s, fp32
    svz: float = 0.0  # m/s, fp32


class LeakSimulation(Message, frozen=True):
    """Leak Simulation."""

    ID: ClassVar[int] = 51
    WIRE: ClassVar[str] = "BT"

    class Op(IntEnum):
        OFF = 0
        ON = 1

    op: int = 0  # uint8, Op
    entities: str = ""  # plaintext


class UASimulation(Message, frozen=True):
    """Underwater Acoustics Simulation."""

    ID: ClassVar[int] = 52
    WIRE: ClassVar[str] = "BHR"

    class Type(IntEnum):
        DATA = 0
        PING = 1
        PING_REPLY = 2

    type: int = 0  # uint8, Type
    speed: int = 0  # bps, uint16
    data: bytes = b""  # rawdata


class DynamicsSimParam(Message, frozen=True):
    """Dynamics Simulation Parameters."""

    ID: ClassVar[int] = 53
    WIRE: ClassVar[str] = "Bff"

    class Op(IntEnum):
        REQUEST = 0
        SET = 1
        REPORT = 2

    op: int = 0  # uint8, Op
    tas2acc_pgain: float = 0.0  # fp32
    bank2p_pgain: float = 0.0  # fp32


class StorageUsage(Message, frozen=True):
    """Storage Usage."""

    ID: ClassVar[int] = 100
    WIRE: ClassVar[str] = "IB"

    available: int = 0  # MiB, uint32
    value: int = 0  # %, uint8, at most 100


class CacheControl(Message, frozen=True):
    """Cache Control."""

    ID: ClassVar[int] = 101
    WIRE: ClassVar[str] = "BTM"

    class Op(IntEnum):
        STORE = 0
        LOAD = 1
        CLEAR = 2
        COPY = 3
        COPY_COMPLETE = 4

    op: int = 0  # uint8, Op
    snapshot: str = ""  # plaintext
    message: Message | None = None  # message


class LoggingControl(Message, frozen=True):
    """Logging Control."""

    ID: ClassVar[int] = 102
    WIRE: ClassVar[str] = "BT"

    class Op(IntEnum):
        REQUEST_START = 0
        STARTED = 1
        REQUEST_STOP = 2
        STOPPED = 3
        REQUEST_CURRENT_NAME = 4
        CURRENT_NAME = 5

    op: int = 0  # uint8, Op
    name: str = ""  # plaintext


class LogBookEntry(Message, frozen=True):
    """Log Book Entry."""

    ID: ClassVar[int] = 103
    WIRE: ClassVar[str] = "BdTT"

    class Type(IntEnum):
        INFO = 0
        WARNING = 1
        ERROR = 2
        CRITICAL = 3
        DEBUG = 4

    type: int = 0  # uint8, Type
    htime: float = 0.0  # s, fp64
    context: str = ""  # plaintext
    text: str = ""  # plaintext


class LogBookControl(MessageWithLists, frozen=True):
    """Log Book Control."""

    ID: ClassVar[int] = 104
    WIRE: ClassVar[str] = "BdL"
    LISTS: ClassVar[tuple[str, ...]] = ("msg",)

    class Command(IntEnum):
        GET = 0
        CLEAR = 1
        GET_ERR = 2
        REPLY = 3

    command: int = 0  # uint8, Command
    htime: float = 0.0  # s, fp64
    msg: tuple[Message | None, ...] = ()  # message-list, LogBookEntry


class ReplayControl(Message, frozen=True):
    """Replay Control."""

    ID: ClassVar[int] = 105
    WIRE: ClassVar[str] = "BT"

    class Op(IntEnum):
        START = 0
        STOP = 1
        PAUSE = 2
        RESUME = 3

    op: int = 0  # uint8, Op
    file: str = ""  # plaintext


class ClockControl(Message, frozen=True):
    """Clock Control."""

    ID: ClassVar[int] = 106
    WIRE: ClassVar[str] = "Bdb"

    class Op(IntEnum):
        SYNC_EXEC = 0
        SYNC_REQUEST = 1
        SYNC_STARTED = 2
        SYNC_DONE = 3
        SET_TZ = 4
        SET_TZ_DONE = 5

    op: int = 0  # uint8, Op
    clock: float = 0.0  # s, fp64
    tz: int = 0  # int8, -23 to 23


class HistoricCTD(Message, frozen=True):
    """Historic CTD."""

    ID: ClassVar[int] = 107
    WIRE: ClassVar[str] = "fff"

    conductivity: float = 0.0  # S/m, fp32
    temperature: float = 0.0  # °C, fp32
    depth: float = 0.0  # m, fp32


class HistoricTelemetry(Message, frozen=True):
    """Historic Telemetry."""

    ID: ClassVar[int] = 108
    WIRE: ClassVar[str] = "fHHHh"

    altitude: float = 0.0  # m, fp32
    roll: int = 0  # uint16
    pitch: int = 0  # uint16
    yaw: int = 0  # uint16
    speed: int = 0  # dm, int16


class HistoricSonarData(Message, frozen=True):
    """Historic Sonar Data."""

    ID: ClassVar[int] = 109
    WIRE: ClassVar[str] = "ffffhBR"

    class Encoding(IntEnum):
        ONE_BYTE_PER_PIXEL = 0
        PNG = 1
        JPEG = 2

    altitude: float = 0.0  # m, fp32
    width: float = 0.0  # m, fp32
    length: float = 0.0  # m, fp32
    bearing: float = 0.0  # fp32
    pxl: int = 0  # int16
    encoding: int = 0  # uint8, Encoding
    sonar_data: bytes = b""  # rawdata


class HistoricEvent(Message, frozen=True):
    """Historic Event."""

    ID: ClassVar[int] = 110
    WIRE: ClassVar[str] = "TB"

    class Type(IntEnum):
        INFO = 0
        ERROR = 1

    text: str = ""  # plaintext
    type: int = 0  # uint8, Type


class VerticalProfile(MessageWithLists, frozen=True):
    """Vertical Profile."""

    ID: ClassVar[int] = 111
    WIRE: ClassVar[str] = "BBLdd"
    LISTS: ClassVar[tuple[str, ...]] = ("samples",)

    class Parameter(IntEnum):
        TEMPERATURE = 0
        SALINITY = 1
        CONDUCTIVITY = 2
        PH = 3
        REDOX = 4
        CHLOROPHYLL = 5
        TURBIDITY = 6
        CURRENT_VELOCITY_N = 7
        CURRENT_VELOCITY_E = 8
        ABSOLUTE_WIND_AVG = 9
        ABSOLUTE_WIND_MAX = 10
        DISS_ORGANIC_MATTER = 11
        DISS_OXYGEN = 12

    parameter: int = 0  # uint8, Parameter
    numsamples: int = 0  # uint8
    samples: tuple[Message | None, ...] = ()  # message-list, ProfileSample
    lat: float = 0.0  # °, fp64
    lon: float = 0.0  # °, fp64


class ProfileSample(Message, frozen=True):
    """Profile Sample."""

    ID: ClassVar[int] = 112
    WIRE: ClassVar[str] = "Hf"

    depth: int = 0  # dm, uint16
    avg: float = 0.0  # fp32


class Heartbeat(Message, frozen=True):
    """Heartbeat."""

    ID: ClassVar[int] = 150


class Announce(Message, frozen=True):
    """Announce."""

    ID: ClassVar[int] = 151
    WIRE: ClassVar[str] = "TBHddfT"

    sys_name: str = ""  # plaintext
    sys_type: int = 0  # uint8, SystemType
    owner: int = 0  # uint16
    lat: float = 0.0  # rad, fp64, -1.5708 to 1.5708
    lon: float = 0.0  # rad, fp64, -3.14159 to 3.14159
    height: float = 0.0  # m, fp32
    services: str = ""  # plaintext


class AnnounceService(Message, frozen=True):
    """Announce Service."""

    ID: ClassVar[int] = 152
    WIRE: ClassVar[str] = "TB"

    class ServiceType(IntFlag):
        EXTERNAL = 0x1
        LOCAL = 0x2

    service: str = ""  # plaintext
    service_type: int = 0  # uint8, ServiceType


class RSSI(Message, frozen=True):
    """Receive Signal Strength Information."""

    ID: ClassVar[int] = 153
    WIRE: ClassVar[str] = "f"

    value: float = 0.0  # %, fp32, at most 100


class VSWR(Message, frozen=True):
    """Voltage Standing Wave Ratio."""

    ID: ClassVar[int] = 154
    WIRE: ClassVar[str] = "f"

    value: float = 0.0  # fp32


class LinkLevel(Message, frozen=True):
    """Link Level."""

    ID: ClassVar[int] = 155
    WIRE: ClassVar[str] = "f"

    value: float = 0.0  # fp32


class Sms(Message, frozen=True):
    """SMS."""

    ID: ClassVar[int] = 156
    WIRE: ClassVar[str] = "THT"

    number: str = ""  # plaintext
    timeout: int = 0  # uint16
    contents: str = ""  # plaintext


class SmsTx(Message, frozen=True):
    """SMS Transmit."""

    ID: ClassVar[int] = 157
    WIRE: ClassVar[str] = "ITHR"

    seq: int = 0  # uint32
    destination: str = ""  # plaintext
    timeout: int = 0  # s, uint16
    data: bytes = b""  # rawdata


class SmsRx(Message, frozen=True):
    """SMS Receive."""

    ID: ClassVar[int] = 158
    WIRE: ClassVar[str] = "TR"

    source: str = ""  # plaintext
    data: bytes = b""  # rawdata


class SmsState(Message, frozen=True):
    """SMS State."""

    ID: ClassVar[int] = 159
    WIRE: ClassVar[str] = "IBT"

    class State(IntEnum):
        ACCEPTED = 0
        REJECTED = 1
        INTERRUPTED = 2
        COMPLETED = 3
        IDLE = 4
        TRANSMITTING = 5
        RECEIVING = 6

    seq: int = 0  # uint32
    state: int = 0  # uint8, State
    error: str = ""  # plaintext


class TextMessage(Message, frozen=True):
    """Text Message."""

    ID: ClassVar[int] = 160
    WIRE: ClassVar[str] = "TT"

    origin: str = ""  # plaintext
    text: str = ""  # plaintext


class IridiumMsgRx(Message, frozen=True):
    """Received Iridium Message."""

    ID: ClassVar[int] = 170
    WIRE: ClassVar[str] = "TdddR"

    origin: str = ""  # plaintext
    htime: float = 0.0  # s, fp64
    lat: float = 0.0  # rad, fp64
    lon: float = 0.0  # rad, fp64
    data: bytes = b""  # rawdata


class IridiumMsgTx(Message, frozen=True):
    """Transmit Iridium Message."""

    ID: ClassVar[int] = 171
    WIRE: ClassVar[str] = "HHTR"

    req_id: int = 0  # uint16
    ttl: int = 0  # s, uint16
    destination: str = ""  # plaintext
    data: bytes = b""  # rawdata


class IridiumTxStatus(Message, frozen=True):
    """Iridium Transmission Status."""

    ID: ClassVar[int] = 172
    WIRE: ClassVar[str] = "HBT"

    class Status(IntEnum):
        OK = 1
        ERROR = 2
        QUEUED = 3
        TRANSMIT = 4
        EXPIRED = 5
        EMPTY = 6

    req_id: int = 0  # uint16
    status: int = 0  # uint8, Status
    text: str = ""  # plaintext


class GroupMembershipState(Message, frozen=True):
    """Group Membership State."""

    ID: ClassVar[int] = 180
    WIRE: ClassVar[str] = "TI"

    group_name: str = ""  # plaintext
    links: int = 0  # uint32


class SystemGroup(Message, frozen=True):
    """System Group."""

    ID: ClassVar[int] = 181
    WIRE: ClassVar[str] = "TBT"

    class Action(IntEnum):
        Dis = 0
        Set = 1
        Req = 2
        Chg = 3
        Rep = 4
        Frc = 5

    groupname: str = ""  # plaintext
    action: int = 0  # uint8, Action
    grouplist: str = ""  # plaintext


class LinkLatency(Message, frozen=True):
    """Link Latency."""

    ID: ClassVar[int] = 182
    WIRE: ClassVar[str] = "fH"

    value: float = 0.0  # s, fp32, at least 0
    sys_src: int = 0  # uint16


class ExtendedRSSI(Message, frozen=True):
    """Extended Receive Signal Strength Information."""

    ID: ClassVar[int] = 183
    WIRE: ClassVar[str] = "fB"

    value: float = 0.0  # fp32
    units: int = 0  # uint8, RSSIUnits


class HistoricData(MessageWithLists, frozen=True):
    """Historic Data Series."""

    ID: ClassVar[int] = 184
    WIRE: ClassVar[str] = "fffL"
    LISTS: ClassVar[tuple[str, ...]] = ("data",)

    base_lat: float = 0.0  # °, fp32
    base_lon: float = 0.0  # °, fp32
    base_time: float = 0.0  # s, fp32
    data: tuple[Message | None, ...] = ()  # message-list, RemoteData


class CompressedHistory(Message, frozen=True):
    """Compressed Historic Data Series."""

    ID: ClassVar[int] = 185
    WIRE: ClassVar[str] = "fffR"

    base_lat: float = 0.0  # °, fp32
    base_lon: float = 0.0  # °, fp32
    base_time: float = 0.0  # s, fp32
    data: bytes = b""  # rawdata


class HistoricSample(Message, frozen=True):
    """Historic Data Sample."""

    ID: ClassVar[int] = 186
    WIRE: ClassVar[str] = "HbhhhhM"

    sys_id: int = 0  # uint16
    priority: int = 0  # int8
    x: int = 0  # m, int16
    y: int = 0  # m, int16
    z: int = 0  # dm, int16
    t: int = 0  # s, int16
    sample: Message | None = None  # message


class HistoricDataQuery(Message, frozen=True):
    """Historic Data Query."""

    ID: ClassVar[int] = 187
    WIRE: ClassVar[str] = "HBHM"

    class Type(IntEnum):
        QUERY = 1
        REPLY = 2
        CLEAR = 3

    req_id: int = 0  # uint16
    type: int = 0  # uint8, Type
    max_size: int = 0  # uint16
    data: Message | None = None  # message, HistoricData


class RemoteCommand(Message, frozen=True):
    """Remote Command."""

    ID: ClassVar[int] = 188
    WIRE: ClassVar[str] = "HHdM"

    original_source: int = 0  # uint16
    destination: int = 0  # uint16
    timeout: float = 0.0  # s, fp64
    cmd: Message | None = None  # message


class CommSystemsQuery(Message, frozen=True):
    """Communication Systems Query."""

    ID: ClassVar[int] = 189
    WIRE: ClassVar[str] = "BHHT"

    class Type(IntFlag):
        QUERY = 0x1
        REPLY = 0x2

    class CommInterface(IntFlag):
        ACOUSTIC = 0x01
        SATELLITE = 0x02
        GSM = 0x04
        MOBILE = 0x08
        RADIO = 0x10

    class Model(IntEnum):
        UNKNOWN = 0
        M3DR = 1
        RDFXXXXPTP = 2

    type: int = 0  # uint8, Type
    comm_interface: int = 0  # uint16, CommInterface
    model: int = 0  # uint16, Model
    list: str = ""  # List, plaintext


class TelemetryMsg(Message, frozen=True):
    """Telemetry Message."""

    ID: ClassVar[int] = 190
    WIRE: ClassVar[str] = "BIHBTTBBR"

    class Type(IntEnum):
        TX = 1
        RX = 2
        TXSTATUS = 3

    class Code(IntEnum):
        CODE_UNK = 0
        CODE_REPORT = 1
        CODE_IMC = 2
        CODE_RAW = 3

    class Acknowledge(IntFlag):
        NAK = 0x0
        AK = 0x1

    class Status(IntEnum):
        NONE = 0
        DONE = 1
        FAILED = 2
        QUEUED = 3
        TRANSMIT = 4
        EXPIRED = 5
        EMPTY = 6
        INV_ADDR = 7
        INV_SIZE = 8

    type: int = 0  # uint8, Type
    req_id: int = 0  # uint32
    ttl: int = 0  # s, uint16
    code: int = 0  # uint8, Code
    destination: str = ""  # plaintext
    source: str = ""  # plaintext
    acknowledge: int = 0  # uint8, Acknowledge
    status: int = 0  # uint8, Status
    data: bytes = b""  # rawdata


class LblRange(Message, frozen=True):
    """LBL Range."""

    ID: ClassVar[int] = 200
    WIRE: ClassVar[str] = "Bf"

    id: int = 0  # uint8
    range: float = 0.0  # m, fp32


class LblBeacon(Message, frozen=True):
    """LBL Beacon Configuration."""

    ID: ClassVar[int] = 202
    WIRE: ClassVar[str] = "TddfBBB"

    beacon: str = ""  # plaintext
    lat: float = 0.0  # rad, fp64, -1.5708 to 1.5708
    lon: float = 0.0  # rad, fp64, -3.14159 to 3.14159
    depth: float = 0.0  # m, fp32
    query_channel: int = 0  # uint8
    reply_channel: int = 0  # uint8
    transponder_delay: int = 0  # ms, uint8


class LblConfig(MessageWithLists, frozen=True):
    """LBL Configuration."""

    ID: ClassVar[int] = 203
    WIRE: ClassVar[str] = "BL"
    LISTS: ClassVar[tuple[str, ...]] = ("beacons",)

    class Op(IntEnum):
        SET_CFG = 0
        GET_CFG = 1
        CUR_CFG = 2

    op: int = 0  # uint8, Op
    beacons: tuple[Message | None, ...] = ()  # message-list, LblBeacon


class AcousticMessage(Message, frozen=True):
    """Acoustic Message."""

    ID: ClassVar[int] = 206
    WIRE: ClassVar[str] = "M"

    message: Message | None = None  # message


class SimAcousticMessage(Message, frozen=True):
    """Simulated Acoustic Message."""

    ID: ClassVar[int] = 207
    WIRE: ClassVar[str] = "ddfTdTTHTBR"

    class Flags(IntFlag):
        ACK = 0x1
        DELAYED = 0x2
        REPLY = 0x3

    lat: float = 0.0  # fp64
    lon: float = 0.0  # fp64
    depth: float = 0.0  # fp32
    sentence: str = ""  # plaintext
    txtime: float = 0.0  # s, fp64
    modem_type: str = ""  # plaintext
    sys_src: str = ""  # plaintext
    seq: int = 0  # uint16
    sys_dst: str = ""  # plaintext
    flags: int = 0  # uint8, Flags
    data: bytes = b""  # rawdata


class AcousticOperation(Message, frozen=True):
    """Acoustic Operation."""

    ID: ClassVar[int] = 211
    WIRE: ClassVar[str] = "BTfM"

    class Op(IntEnum):
        ABORT = 0
        ABORT_IP = 1
        ABORT_TIMEOUT = 2
        ABORT_ACKED = 3
        RANGE = 4
        RANGE_IP = 5
        RANGE_TIMEOUT = 6
        RANGE_RECVED = 7
        BUSY = 8
        UNSUPPORTED = 9
        NO_TXD = 10
        MSG = 11
        MSG_QUEUED = 12
        MSG_IP = 13
        MSG_DONE = 14
        MSG_FAILURE = 15
        MSG_SHORT = 16
        REVERSE_RANGE = 17
        FORCED_ABORT = 18
        MSG_FRAGMENT = 19

    op: int = 0  # uint8, Op
    system: str = ""  # plaintext
    range: float = 0.0  # m, fp32
    msg: Message | None = None  # message


class AcousticSystemsQuery(Message, frozen=True):
    """Acoustic Systems Query."""

    ID: ClassVar[int] = 212


class AcousticSystems(Message, frozen=True):
    """Acoustic Systems."""

    ID: ClassVar[int] = 213
    WIRE: ClassVar[str] = "T"

    list: str = ""  # List, plaintext


class AcousticLink(Message, frozen=True):
    """Acoustic Link Quality."""

    ID: ClassVar[int] = 214
    WIRE: ClassVar[str] = "TfH"

    peer: str = ""  # plaintext
    rssi: float = 0.0  # dB, fp32
    integrity: int = 0  # uint16


class AcousticRequest(Message, frozen=True):
    """Acoustic Transmission Request."""

    ID: ClassVar[int] = 215
    WIRE: ClassVar[str] = "HTdfBM"

    class Type(IntEnum):
        ABORT = 0
        RANGE = 1
        REVERSE_RANGE = 2
        MSG = 3
        RAW = 4

    req_id: int = 0  # uint16
    destination: str = ""  # plaintext
    timeout: float = 0.0  # s, fp64
    range: float = 0.0  # m, fp32
    type: int = 0  # uint8, Type
    msg: Message | None = None  # message


class AcousticStatus(Message, frozen=True):
    """Acoustic Transmission Status."""

    ID: ClassVar[int] = 216
    WIRE: ClassVar[str] = "HBBTf"

    class Type(IntEnum):
        ABORT = 0
        RANGE = 1
        REVERSE_RANGE = 2
        MSG = 3
        RAW = 4

    class Status(IntEnum):
        QUEUED = 0
        IN_PROGRESS = 1
        SENT = 2
        RANGE_RECEIVED = 3
        DELIVERED = 4
        BUSY = 100
        INPUT_FAILURE = 101
        ERROR = 102
        INV_ADDR = 103
        UNSUPPORTED = 255

    req_id: int = 0  # uint16
    type: int = 0  # uint8, Type
    status: int = 0  # uint8, Status
    info: str = ""  # plaintext
    range: float = 0.0  # m, fp32


class AcousticRelease(Message, frozen=True):
    """Acoustic Release Request."""

    ID: ClassVar[int] = 217
    WIRE: ClassVar[str] = "TB"

    class Op(IntEnum):
        OPEN = 0
        CLOSE = 1

    system: str = ""  # plaintext
    op: int = 0  # uint8, Op


class Rpm(Message, frozen=True):
    """Revolutions Per Minute."""

    ID: ClassVar[int] = 250
    WIRE: ClassVar[str] = "h"

    value: int = 0  # rpm, int16


class Voltage(Message, frozen=True):
    """Voltage."""

    ID: ClassVar[int] = 251
    WIRE: ClassVar[str] = "f"

    value: float = 0.0  # V, fp32


class Current(Message, frozen=True):
    """Current."""

    ID: ClassVar[int] = 252
    WIRE: ClassVar[str] = "f"

    value: float = 0.0  # A, fp32


class GpsFix(Message, frozen=True):
    """GPS Fix."""

    ID: ClassVar[int] = 253
    WIRE: ClassVar[str] = "HBHBBfddfBffffff"

    class Validity(IntFlag):
        VALID_DATE = 0x001
        VALID_TIME = 0x002
        VALID_POS = 0x004
        VALID_COG = 0x008
        VALID_SOG = 0x010
        VALID_HACC = 0x020
        VALID_VACC = 0x040
        VALID_HDOP = 0x080
        VALID_VDOP = 0x100

    class Type(IntEnum):
        STANDALONE = 0
        DIFFERENTIAL = 1
        DEAD_RECKONING = 2
        MANUAL_INPUT = 3
        SIMULATION = 4

    validity: int = 0  # uint16, Validity
    type: int = 0  # uint8, Type
    utc_year: int = 0  # uint16
    utc_month: int = 0  # uint8
    utc_day: int = 0  # uint8
    utc_time: float = 0.0  # s, fp32
    lat: float = 0.0  # rad, fp64, -1.5708 to 1.5708
    lon: float = 0.0  # rad, fp64, -3.14159 to 3.14159
    height: float = 0.0  # m, fp32
    satellites: int = 0  # uint8
    cog: float = 0.0  # rad, fp32
    sog: float = 0.0  # m/s, fp32
    hdop: float = 0.0  # fp32
    vdop: float = 0.0  # fp32
    hacc: float = 0.0  # m, fp32
    vacc: float = 0.0  # m, fp32


class EulerAngles(Message, frozen=True):
    """Euler Angles."""

    ID: ClassVar[int] = 254
    WIRE: ClassVar[str] = "ddddd"

    time: float = 0.0  # s, fp64
    phi: float = 0.0  # rad, fp64, -3.14159 to 3.14159
    theta: float = 0.0  # rad, fp64, -1.5708 to 1.5708
    psi: float = 0.0  # rad, fp64, -3.14159 to 3.14159
    psi_magnetic: float = 0.0  # rad, fp64, -3.14159 to 3.14159


class EulerAnglesDelta(Message, frozen=True):
    """Euler Angles Delta."""

    ID: ClassVar[int] = 255
    WIRE: ClassVar[str] = "ddddf"

    time: float = 0.0  # s, fp64
    x: float = 0.0  # rad, fp64
    y: float = 0.0  # rad, fp64
    z: float = 0.0  # rad, fp64
    timestep: float = 0.0  # s, fp32


class AngularVelocity(Message, frozen=True):
    """Angular Velocity."""

    ID: ClassVar[int] = 256
    WIRE: ClassVar[str] = "dddd"

    time: float = 0.0  # s, fp64
    x: float = 0.0  # rad/s, fp64
    y: float = 0.0  # rad/s, fp64
    z: float = 0.0  # rad/s, fp64


class Acceleration(Message, frozen=True):
    """Acceleration."""

    ID: ClassVar[int] = 257
    WIRE: ClassVar[str] = "dddd"

    time: float = 0.0  # s, fp64
    x: float = 0.0  # m/s/s, fp64
    y: float = 0.0  # m/s/s, fp64
    z: float = 0.0  # m/s/s, fp64


class MagneticField(Message, frozen=True):
    """Magnetic Field."""

    ID: ClassVar[int] = 258
    WIRE: ClassVar[str] = "dddd"

    time: float = 0.0  # s, fp64
    x: float = 0.0  # G, fp64
    y: float = 0.0  # G, fp64
    z: float = 0.0  # G, fp64


class GroundVelocity(Message, frozen=True):
    """Ground Velocity."""

    ID: ClassVar[int] = 259
    WIRE: ClassVar[str] = "Bddd"

    class Validity(IntFlag):
        VEL_X = 0x1
        VEL_Y = 0x2
        VEL_Z = 0x4

    validity: int = 0  # uint8, Validity
    x: float = 0.0  # m/s, fp64
    y: float = 0.0  # m/s, fp64
    z: float = 0.0  # m/s, fp64


class WaterVelocity(Message, frozen=True):
    """Water Velocity."""

    ID: ClassVar[int] = 260
    WIRE: ClassVar[str] = "Bddd"

    class Validity(IntFlag):
        VEL_X = 0x1
        VEL_Y = 0x2
        VEL_Z = 0x4

    validity: int = 0  # uint8, Validity
    x: float = 0.0  # m/s, fp64
    y: float = 0.0  # m/s, fp64
    z: float = 0.0  # m/s, fp64


class VelocityDelta(Message, frozen=True):
    """Velocity Delta."""

    ID: ClassVar[int] = 261
    WIRE: ClassVar[str] = "dddd"

    time: float = 0.0  # s, fp64
    x: float = 0.0  # m/s, fp64
    y: float = 0.0  # m/s, fp64
    z: float = 0.0  # m/s, fp64


class Distance(MessageWithLists, frozen=True):
    """Distance."""

    ID: ClassVar[int] = 262
    WIRE: ClassVar[str] = "BLLf"
    LISTS: ClassVar[tuple[str, ...]] = ("location", "beam_config")

    class Validity(IntEnum):
        INVALID = 0
        VALID = 1

    validity: int = 0  # uint8, Validity
    location: tuple[Message | None, ...] = ()  # message-list, DeviceState
    beam_config: tuple[Message | None, ...] = ()  # message-list, BeamConfig
    value: float = 0.0  # m, fp32


class Temperature(Message, frozen=True):
    """Temperature."""

    ID: ClassVar[int] = 263
    WIRE: ClassVar[str] = "f"

    value: float = 0.0  # °C, fp32


class Pressure(Message, frozen=True):
    """Pressure."""

    ID: ClassVar[int] = 264
    WIRE: ClassVar[str] = "d"

    value: float = 0.0  # hPa, fp64


class Depth(Message, frozen=True):
    """Depth."""

    ID: ClassVar[int] = 265
    WIRE: ClassVar[str] = "f"

    value: float = 0.0  # m, fp32


class DepthOffset(Message, frozen=True):
    """Depth Offset."""

    ID: ClassVar[int] = 266
    WIRE: ClassVar[str] = "f"

    value: float = 0.0  # m, fp32


class SoundSpeed(Message, frozen=True):
    """Sound Speed."""

    ID: ClassVar[int] = 267
    WIRE: ClassVar[str] = "f"

    value: float = 0.0  # m/s, fp32


class WaterDensity(Message, frozen=True):
    """Water Density."""

    ID: ClassVar[int] = 268
    WIRE: ClassVar[str] = "f"

    value: float = 0.0  # kg/m/m/m, fp32


class Conductivity(Message, frozen=True):
    """Conductivity."""

    ID: ClassVar[int] = 269
    WIRE: ClassVar[str] = "f"

    value: float = 0.0  # S/m, fp32


class Salinity(Message, frozen=True):
    """Salinity."""

    ID: ClassVar[int] = 270
    WIRE: ClassVar[str] = "f"

    value: float = 0.0  # PSU, fp32


class WindSpeed(Message, frozen=True):
    """Wind Speed."""

    ID: ClassVar[int] = 271
    WIRE: ClassVar[str] = "fff"

    direction: float = 0.0  # rad, fp32
    speed: float = 0.0  # m/s, fp32
    turbulence: float = 0.0  # m/s, fp32


class RelativeHumidity(Message, frozen=True):
    """Relative Humidity."""

    ID: ClassVar[int] = 272
    WIRE: ClassVar[str] = "f"

    value: float = 0.0  # fp32, 0 to 100


class DevDataText(Message, frozen=True):
    """Device Data (Text)."""

    ID: ClassVar[int] = 273
    WIRE: ClassVar[str] = "T"

    value: str = ""  # plaintext


class DevDataBinary(Message, frozen=True):
    """Device Data (Binary)."""

    ID: ClassVar[int] = 274
    WIRE: ClassVar[str] = "R"

    value: bytes = b""  # rawdata


class Force(Message, frozen=True):
    """Force."""

    ID: ClassVar[int] = 275
    WIRE: ClassVar[str] = "f"

    value: float = 0.0  # N, fp32


class SonarData(MessageWithLists, frozen=True):
    """Sonar Data."""

    ID: ClassVar[int] = 276
    WIRE: ClassVar[str] = "BIHHBfLR"
    LISTS: ClassVar[tuple[str, ...]] = ("beam_config",)

    class Type(IntEnum):
        SIDESCAN = 0
        ECHOSOUNDER = 1
        MULTIBEAM = 2
        PENCILBEAM = 3

    type: int = 0  # uint8, Type
    frequency: int = 0  # Hz, uint32
    min_range: int = 0  # m, uint16
    max_range: int = 0  # m, uint16
    bits_per_point: int = 0  # bit, uint8
    scale_factor: float = 0.0  # fp32
    beam_config: tuple[Message | None, ...] = ()  # message-list, BeamConfig
    data: bytes = b""  # rawdata


class Pulse(Message, frozen=True):
    """Pulse."""

    ID: ClassVar[int] = 277


class PulseDetectionControl(Message, frozen=True):
    """Pulse Detection Control."""

    ID: ClassVar[int] = 278
    WIRE: ClassVar[str] = "B"

    class Op(IntEnum):
        OFF = 0
        ON = 1

    op: int = 0  # uint8, Op


class FuelLevel(Message, frozen=True):
    """Fuel Level."""

    ID: ClassVar[int] = 279
    WIRE: ClassVar[str] = "ffT"

    value: float = 0.0  # %, fp32, 0 to 100
    confidence: float = 0.0  # %, fp32, 0 to 100
    opmodes: str = ""  # TupleList, plaintext


class GpsNavData(Message, frozen=True):
    """GPS Navigation Data."""

    ID: ClassVar[int] = 280
    WIRE: ClassVar[str] = "Iddffffffffffff"

    itow: int = 0  # ms, uint32
    lat: float = 0.0  # rad, fp64
    lon: float = 0.0  # rad, fp64
    height_ell: float = 0.0  # m, fp32
    height_sea: float = 0.0  # m, fp32
    hacc: float = 0.0  # m, fp32
    vacc: float = 0.0  # m, fp32
    vel_n: float = 0.0  # m/s, fp32
    vel_e: float = 0.0  # m/s, fp32
    vel_d: float = 0.0  # m/s, fp32
    speed: float = 0.0  # m/s, fp32
    gspeed: float = 0.0  # m/s, fp32
    heading: float = 0.0  # rad, fp32
    sacc: float = 0.0  # m/s, fp32
    cacc: float = 0.0  # rad, fp32


class ServoPosition(Message, frozen=True):
    """Servo Position."""

    ID: ClassVar[int] = 281
    WIRE: ClassVar[str] = "Bf"

    id: int = 0  # uint8
    value: float = 0.0  # rad, fp32, -1.5708 to 1.5708


class DeviceState(Message, frozen=True):
    """Device State."""

    ID: ClassVar[int] = 282
    WIRE: ClassVar[str] = "ffffff"

    x: float = 0.0  # m, fp32
    y: float = 0.0  # m, fp32
    z: float = 0.0  # m, fp32
    phi: float = 0.0  # rad, fp32
    theta: float = 0.0  # rad, fp32
    psi: float = 0.0  # rad, fp32


class BeamConfig(Message, frozen=True):
    """Beam Configuration."""

    ID: ClassVar[int] = 283
    WIRE: ClassVar[str] = "ff"

    beam_width: float = 0.0  # rad, fp32, 0 to 3.14159
    beam_height: float = 0.0  # rad, fp32, 0 to 3.14159


class DataSanity(Message, frozen=True):
    """Data Sanity."""

    ID: ClassVar[int] = 284
    WIRE: ClassVar[str] = "B"

    class Sane(IntEnum):
        SANE = 0
        NOT_SANE = 1

    sane: int = 0  # uint8, Sane


class RhodamineDye(Message, frozen=True):
    """Rhodamine Dye."""

    ID: ClassVar[int] = 285
    WIRE: ClassVar[str] = "f"

    value: float = 0.0  # PPB, fp32


class CrudeOil(Message, frozen=True):
    """Crude Oil."""

    ID: ClassVar[int] = 286
    WIRE: ClassVar[str] = "f"

    value: float = 0.0  # PPB, fp32


class FineOil(Message, frozen=True):
    """Fine Oil."""

    ID: ClassVar[int] = 287
    WIRE: ClassVar[str] = "f"

    value: float = 0.0  # PPB, fp32


class Turbidity(Message, frozen=True):
    """Turbidity."""

    ID: ClassVar[int] = 288
    WIRE: ClassVar[str] = "f"

    value: float = 0.0  # NTU, fp32


class Chlorophyll(Message, frozen=True):
    """Chlorophyll."""

    ID: ClassVar[int] = 289
    WIRE: ClassVar[str] = "f"

    value: float = 0.0  # µg/L, fp32


class Fluorescein(Message, frozen=True):
    """Fluorescein."""

    ID: ClassVar[int] = 290
    WIRE: ClassVar[str] = "f"

    value: float = 0.0  # PPB, fp32


class Phycocyanin(Message, frozen=True):
    """Phycocyanin."""

    ID: ClassVar[int] = 291
    WIRE: ClassVar[str] = "f"

    value: float = 0.0  # PPB, fp32


class Phycoerythrin(Message, frozen=True):
    """Phycoerythrin."""

    ID: ClassVar[int] = 292
    WIRE: ClassVar[str] = "f"

    value: float = 0.0  # PPB, fp32


class GpsFixRtk(Message, frozen=True):
    """GPS Fix RTK."""

    ID: ClassVar[int] = 293
    WIRE: ClassVar[str] = "HBIddfffffffBHf"

    class Validity(IntFlag):
        VALID_TIME = 0x1
        VALID_BASE = 0x2
        VALID_POS = 0x4
        VALID_VEL = 0x8

    class Type(IntEnum):
        NONE = 0
        OBS = 1
        FLOAT = 2
        FIXED = 3

    validity: int = 0  # uint16, Validity
    type: int = 0  # uint8, Type
    tow: int = 0  # uint32
    base_lat: float = 0.0  # rad, fp64, -1.5708 to 1.5708
    base_lon: float = 0.0  # rad, fp64, -3.14159 to 3.14159
    base_height: float = 0.0  # m, fp32
    n: float = 0.0  # m, fp32
    e: float = 0.0  # m, fp32
    d: float = 0.0  # m, fp32
    v_n: float = 0.0  # m/s, fp32
    v_e: float = 0.0  # m/s, fp32
    v_d: float = 0.0  # m/s, fp32
    satellites: int = 0  # uint8
    iar_hyp: int = 0  # uint16
    iar_ratio: float = 0.0  # fp32


class ExternalNavData(Message, frozen=True):
    """External Navigation Data."""

    ID: ClassVar[int] = 294
    WIRE: ClassVar[str] = "MB"

    class Type(IntEnum):
        FULL = 0
        AHRS = 1
        POSREF = 2

    state: Message | None = None  # message, EstimatedState
    type: int = 0  # uint8, Type


class DissolvedOxygen(Message, frozen=True):
    """Dissolved Oxygen."""

    ID: ClassVar[int] = 295
    WIRE: ClassVar[str] = "f"

    value: float = 0.0  # µM, fp32


class AirSaturation(Message, frozen=True):
    """Air Saturation."""

    ID: ClassVar[int] = 296
    WIRE: ClassVar[str] = "f"

    value: float = 0.0  # %, fp32


class Throttle(Message, frozen=True):
    """Throttle."""

    ID: ClassVar[int] = 297
    WIRE: ClassVar[str] = "d"

    value: float = 0.0  # %, fp64


class PH(Message, frozen=True):
    """pH."""

    ID: ClassVar[int] = 298
    WIRE: ClassVar[str] = "f"

    value: float = 0.0  # fp32


class Redox(Message, frozen=True):
    """Redox Potential."""

    ID: ClassVar[int] = 299
    WIRE: ClassVar[str] = "f"

    value: float = 0.0  # V, fp32


class CameraZoom(Message, frozen=True):
    """Camera Zoom."""

    ID: ClassVar[int] = 300
    WIRE: ClassVar[str] = "BBB"

    class Action(IntEnum):
        ZOOM_RESET = 0
        ZOOM_IN = 1
        ZOOM_OUT = 2
        ZOOM_STOP = 3

    id: int = 0  # uint8
    zoom: int = 0  # uint8
    action: int = 0  # uint8, Action


class SetThrusterActuation(Message, frozen=True):
    """Set Thruster Actuation."""

    ID: ClassVar[int] = 301
    WIRE: ClassVar[str] = "Bf"

    id: int = 0  # uint8
    value: float = 0.0  # fp32, -1 to 1


class SetServoPosition(Message, frozen=True):
    """Set Servo Position."""

    ID: ClassVar[int] = 302
    WIRE: ClassVar[str] = "Bf"

    id: int = 0  # uint8
    value: float = 0.0  # rad, fp32, -1.5708 to 1.5708


class SetControlSurfaceDeflection(Message, frozen=True):
    """Set Control Surface Deflection."""

    ID: ClassVar[int] = 303
    WIRE: ClassVar[str] = "Bf"

    id: int = 0  # uint8
    angle: float = 0.0  # rad, fp32


class RemoteActionsRequest(Message, frozen=True):
    """Remote Actions Request."""

    ID: ClassVar[int] = 304
    WIRE: ClassVar[str] = "BT"

    class Op(IntEnum):
        REPORT = 0
        QUERY = 1
        REGISTER = 2

    op: int = 0  # uint8, Op
    actions: str = ""  # TupleList, plaintext


class RemoteActions(Message, frozen=True):
    """Remote Actions."""

    ID: ClassVar[int] = 305
    WIRE: ClassVar[str] = "T"

    actions: str = ""  # TupleList, plaintext


class ButtonEvent(Message, frozen=True):
    """Button Event."""

    ID: ClassVar[int] = 306
    WIRE: ClassVar[str] = "BB"

    button: int = 0  # uint8
    value: int = 0  # uint8


class LcdControl(Message, frozen=True):
    """LCD Control."""

    ID: ClassVar[int] = 307
    WIRE: ClassVar[str] = "BT"

    class Op(IntEnum):
        TURN_OFF = 0
        TURN_ON = 1
        CLEAR = 2
        WRITE0 = 3
        WRITE1 = 4

    op: int = 0  # uint8, Op
    text: str = ""  # plaintext


class PowerOperation(Message, frozen=True):
    """Power Operation."""

    ID: ClassVar[int] = 308
    WIRE: ClassVar[str] = "Bfd"

    class Op(IntEnum):
        PWR_DOWN = 0
        PWR_DOWN_IP = 1
        PWR_DOWN_ABORTED = 2
        SCHED_PWR_DOWN = 3
        PWR_UP = 4
        PWR_UP_IP = 5
        SCHED_PWR_UP = 6

    op: int = 0  # uint8, Op
    time_remain: float = 0.0  # s, fp32
    sched_time: float = 0.0  # s, fp64


class PowerChannelControl(Message, frozen=True):
    """Power Channel Control."""

    ID: ClassVar[int] = 309
    WIRE: ClassVar[str] = "TBd"

    class Op(IntEnum):
        TURN_OFF = 0
        TURN_ON = 1
        TOGGLE = 2
        SCHED_ON = 3
        SCHED_OFF = 4
        SCHED_RESET = 5
        SAVE = 6
        RESTART = 7

    name: str = ""  # plaintext
    op: int = 0  # uint8, Op, at most 7
    sched_time: float = 0.0  # s, fp64


class QueryPowerChannelState(Message, frozen=True):
    """Query Power Channel State."""

    ID: ClassVar[int] = 310


class PowerChannelState(Message, frozen=True):
    """Power Channel State."""

    ID: ClassVar[int] = 311
    WIRE: ClassVar[str] = "TB"

    class State(IntEnum):
        OFF = 0
        ON = 1

    name: str = ""  # plaintext
    state: int = 0  # uint8, State


class LedBrightness(Message, frozen=True):
    """LED Brightness."""

    ID: ClassVar[int] = 312
    WIRE: ClassVar[str] = "TB"

    name: str = ""  # plaintext
    value: int = 0  # uint8


class QueryLedBrightness(Message, frozen=True):
    """Query LED Brightness."""

    ID: ClassVar[int] = 313
    WIRE: ClassVar[str] = "T"

    name: str = ""  # plaintext


class SetLedBrightness(Message, frozen=True):
    """Set LED Brightness."""

    ID: ClassVar[int] = 314
    WIRE: ClassVar[str] = "TB"

    name: str = ""  # plaintext
    value: int = 0  # uint8


class SetPWM(Message, frozen=True):
    """Set PWM."""

    ID: ClassVar[int] = 315
    WIRE: ClassVar[str] = "BII"

    id: int = 0  # uint8
    period: int = 0  # µs, uint32
    duty_cycle: int = 0  # µs, uint32


class PWM(Message, frozen=True):
    """PWM."""

    ID: ClassVar[int] = 316
    WIRE: ClassVar[str] = "BII"

    id: int = 0  # uint8
    period: int = 0  # µs, uint32
    duty_cycle: int = 0  # µs, uint32


class EstimatedState(Message, frozen=True):
    """Estimated State."""

    ID: ClassVar[int] = 350
    WIRE: ClassVar[str] = "ddffffffffffffffffff"

    lat: float = 0.0  # rad, fp64, -1.5708 to 1.5708
    lon: float = 0.0  # rad, fp64, -3.14159 to 3.14159
    height: float = 0.0  # m, fp32
    x: float = 0.0  # m, fp32
    y: float = 0.0  # m, fp32
    z: float = 0.0  # m, fp32
    phi: float = 0.0  # rad, fp32, -3.14159 to 3.14159
    theta: float = 0.0  # rad, fp32, -1.5708 to 1.5708
    psi: float = 0.0  # rad, fp32, -3.14159 to 3.14159
    u: float = 0.0  # m/s, fp32
    v: float = 0.0  # m/s, fp32
    w: float = 0.0  # m/s, fp32
    vx: float = 0.0  # m/s, fp32
    vy: float = 0.0  # m/s, fp32
    vz: float = 0.0  # m/s, fp32
    p: float = 0.0  # rad/s, fp32, -3.14159 to 3.14159
    q: float = 0.0  # rad/s, fp32, -3.14159 to 3.14159
    r: float = 0.0  # rad/s, fp32, -3.14159 to 3.14159
    depth: float = 0.0  # m, fp32
    alt: float = 0.0  # m, fp32


class EstimatedStreamVelocity(Message, frozen=True):
    """Estimated Stream Velocity."""

    ID: ClassVar[int] = 351
    WIRE: ClassVar[str] = "ddd"

    x: float = 0.0  # m/s, fp64
    y: float = 0.0  # m/s, fp64
    z: float = 0.0  # m/s, fp64


class IndicatedSpeed(Message, frozen=True):
    """Indicated Speed."""

    ID: ClassVar[int] = 352
    WIRE: ClassVar[str] = "d"

    value: float = 0.0  # m/s, fp64


class TrueSpeed(Message, frozen=True):
    """True Speed."""

    ID: ClassVar[int] = 353
    WIRE: ClassVar[str] = "d"

    value: float = 0.0  # m/s, fp64


class NavigationUncertainty(Message, frozen=True):
    """Navigation Uncertainty."""

    ID: ClassVar[int] = 354
    WIRE: ClassVar[str] = "ffffffffffffff"

    x: float = 0.0  # m, fp32
    y: float = 0.0  # m, fp32
    z: float = 0.0  # m, fp32
    phi: float = 0.0  # rad, fp32
    theta: float = 0.0  # rad, fp32
    psi: float = 0.0  # rad, fp32
    p: float = 0.0  # rad/s, fp32
    q: float = 0.0  # rad/s, fp32
    r: float = 0.0  # rad/s, fp32
    u: float = 0.0  # m/s, fp32
    v: float = 0.0  # m/s, fp32
    w: float = 0.0  # m/s, fp32
    bias_psi: float = 0.0  # rad, fp32
    bias_r: float = 0.0  # rad/s, fp32


class NavigationData(Message, frozen=True):
    """Navigation Data."""

    ID: ClassVar[int] = 355
    WIRE: ClassVar[str] = "fffffffff"

    bias_psi: float = 0.0  # rad, fp32
    bias_r: float = 0.0  # rad/s, fp32
    cog: float = 0.0  # rad, fp32
    cyaw: float = 0.0  # rad, fp32
    lbl_rej_level: float = 0.0  # fp32
    gps_rej_level: float = 0.0  # fp32
    custom_x: float = 0.0  # fp32
    custom_y: float = 0.0  # fp32
    custom_z: float = 0.0  # fp32


class GpsFixRejection(Message, frozen=True):
    """GPS Fix Rejection."""

    ID: ClassVar[int] = 356
    WIRE: ClassVar[str] = "fB"

    class Reason(IntEnum):
        ABOVE_THRESHOLD = 0
        INVALID = 1
        ABOVE_MAX_HDOP = 2
        ABOVE_MAX_HACC = 3
        LOST_VAL_BIT = 4

    utc_time: float = 0.0  # s, fp32
    reason: int = 0  # uint8, Reason


class LblRangeAcceptance(Message, frozen=True):
    """LBL Range Acceptance."""

    ID: ClassVar[int] = 357
    WIRE: ClassVar[str] = "BfB"

    class Acceptance(IntEnum):
        ACCEPTED = 0
        ABOVE_THRESHOLD = 1
        SINGULAR = 2
        NO_INFO = 3
        AT_SURFACE = 4

    id: int = 0  # uint8
    range: float = 0.0  # m, fp32
    acceptance: int = 0  # uint8, Acceptance


class DvlRejection(Message, frozen=True):
    """DVL Rejection."""

    ID: ClassVar[int] = 358
    WIRE: ClassVar[str] = "BBff"

    class Type(IntFlag):
        GV = 0x1
        WV = 0x2

    class Reason(IntEnum):
        INNOV_THRESHOLD_X = 0
        INNOV_THRESHOLD_Y = 1
        ABS_THRESHOLD_X = 2
        ABS_THRESHOLD_Y = 3

    type: int = 0  # uint8, Type
    reason: int = 0  # uint8, Reason
    value: float = 0.0  # m/s, fp32
    timestep: float = 0.0  # s, fp32


class LblEstimate(Message, frozen=True):
    """LBL Beacon Position Estimate."""

    ID: ClassVar[int] = 360
    WIRE: ClassVar[str] = "Mfffff"

    beacon: Message | None = None  # message, LblBeacon
    x: float = 0.0  # m, fp32
    y: float = 0.0  # m, fp32
    var_x: float = 0.0  # m, fp32
    var_y: float = 0.0  # m, fp32
    distance: float = 0.0  # m, fp32


class AlignmentState(Message, frozen=True):
    """Alignment State."""

    ID: ClassVar[int] = 361
    WIRE: ClassVar[str] = "B"

    class State(IntEnum):
        NOT_ALIGNED = 0
        ALIGNED = 1
        NOT_SUPPORTED = 2
        ALIGNING = 3
        WRONG_MEDIUM = 4
        COARSE_ALIGNMENT = 5
        FINE_ALIGNMENT = 6
        SYSTEM_READY = 7

    state: int = 0  # uint8, State


class GroupStreamVelocity(Message, frozen=True):
    """GroupStreamVelocity."""

    ID: ClassVar[int] = 362
    WIRE: ClassVar[str] = "ddd"

    x: float = 0.0  # m/s, fp64
    y: float = 0.0  # m/s, fp64
    z: float = 0.0  # m/s, fp64


class Airflow(Message, frozen=True):
    """Airflow."""

    ID: ClassVar[int] = 363
    WIRE: ClassVar[str] = "fff"

    va: float = 0.0  # m/s, fp32
    aoa: float = 0.0  # rad, fp32
    ssa: float = 0.0  # rad, fp32


class Power(Message, frozen=True):
    """Power."""

    ID: ClassVar[int] = 364
    WIRE: ClassVar[str] = "f"

    value: float = 0.0  # W, fp32


class DesiredHeading(Message, frozen=True):
    """Desired Heading."""

    ID: ClassVar[int] = 400
    WIRE: ClassVar[str] = "d"

    value: float = 0.0  # rad, fp64


class DesiredZ(Message, frozen=True):
    """Desired Z."""

    ID: ClassVar[int] = 401
    WIRE: ClassVar[str] = "fB"

    value: float = 0.0  # m, fp32
    z_units: int = 0  # uint8, ZUnits


class DesiredSpeed(Message, frozen=True):
    """Desired Speed."""

    ID: ClassVar[int] = 402
    WIRE: ClassVar[str] = "dB"

    value: float = 0.0  # fp64
    speed_units: int = 0  # uint8, SpeedUnits


class DesiredRoll(Message, frozen=True):
    """Desired Roll."""

    ID: ClassVar[int] = 403
    WIRE: ClassVar[str] = "d"

    value: float = 0.0  # rad, fp64


class DesiredPitch(Message, frozen=True):
    """Desired Pitch."""

    ID: ClassVar[int] = 404
    WIRE: ClassVar[str] = "d"

    value: float = 0.0  # rad, fp64


class DesiredVerticalRate(Message, frozen=True):
    """Desired Vertical Rate."""

    ID: ClassVar[int] = 405
    WIRE: ClassVar[str] = "d"

    value: float = 0.0  # m/s, fp64


class DesiredPath(Message, frozen=True):
    """Desired Path."""

    ID: ClassVar[int] = 406
    WIRE: ClassVar[str] = "IddfBddfBfBfB"

    class Flags(IntFlag):
        START = 0x01
        DIRECT = 0x02
        NO_Z = 0x04
        _3DTRACK = 0x08
        CCLOCKW = 0x10
        LOITER_CURR = 0x20
        TAKEOFF = 0x40
        LAND = 0x80

    path_ref: int = 0  # uint32
    start_lat: float = 0.0  # rad, fp64, -1.5708 to 1.5708
    start_lon: float = 0.0  # rad, fp64, -3.14159 to 3.14159
    start_z: float = 0.0  # m, fp32
    start_z_units: int = 0  # uint8, ZUnits
    end_lat: float = 0.0  # rad, fp64, -1.5708 to 1.5708
    end_lon: float = 0.0  # rad, fp64, -3.14159 to 3.14159
    end_z: float = 0.0  # m, fp32
    end_z_units: int = 0  # uint8, ZUnits
    speed: float = 0.0  # fp32
    speed_units: int = 0  # uint8, SpeedUnits
    lradius: float = 0.0  # m, fp32
    flags: int = 0  # uint8, Flags


class DesiredControl(Message, frozen=True):
    """Desired Control."""

    ID: ClassVar[int] = 407
    WIRE: ClassVar[str] = "ddddddB"

    class Flags(IntFlag):
        X = 0x01
        Y = 0x02
        Z = 0x04
        K = 0x08
        M = 0x10
        N = 0x20

    x: float = 0.0  # N, fp64
    y: float = 0.0  # N, fp64
    z: float = 0.0  # N, fp64
    k: float = 0.0  # Nm, fp64
    m: float = 0.0  # Nm, fp64
    n: float = 0.0  # Nm, fp64
    flags: int = 0  # uint8, Flags


class DesiredHeadingRate(Message, frozen=True):
    """Desired Heading Rate."""

    ID: ClassVar[int] = 408
    WIRE: ClassVar[str] = "d"

    value: float = 0.0  # rad/s, fp64


class DesiredVelocity(Message, frozen=True):
    """Desired Velocity."""

    ID: ClassVar[int] = 409
    WIRE: ClassVar[str] = "ddddddB"

    class Flags(IntFlag):
        SURGE = 0x01
        SWAY = 0x02
        HEAVE = 0x04
        ROLL = 0x08
        PITCH = 0x10
        YAW = 0x20

    u: float = 0.0  # m/s, fp64
    v: float = 0.0  # m/s, fp64
    w: float = 0.0  # m/s, fp64
    p: float = 0.0  # m/s, fp64
    q: float = 0.0  # m/s, fp64
    r: float = 0.0  # m/s, fp64
    flags: int = 0  # uint8, Flags


class PathControlState(Message, frozen=True):
    """Path Control State."""

    ID: ClassVar[int] = 410
    WIRE: ClassVar[str] = "IddfBddfBfBfffffffH"

    class Flags(IntFlag):
        NEAR = 0x01
        LOITERING = 0x02
        NO_Z = 0x04
        _3DTRACK = 0x08
        CCLOCKW = 0x10

    path_ref: int = 0  # uint32
    start_lat: float = 0.0  # rad, fp64, -1.5708 to 1.5708
    start_lon: float = 0.0  # rad, fp64, -3.14159 to 3.14159
    start_z: float = 0.0  # m, fp32
    start_z_units: int = 0  # uint8, ZUnits
    end_lat: float = 0.0  # rad, fp64, -1.5708 to 1.5708
    end_lon: float = 0.0  # rad, fp64, -3.14159 to 3.14159
    end_z: float = 0.0  # m, fp32
    end_z_units: int = 0  # uint8, ZUnits
    lradius: float = 0.0  # m, fp32
    flags: int = 0  # uint8, Flags
    x: float = 0.0  # m, fp32
    y: float = 0.0  # m, fp32
    z: float = 0.0  # m, fp32
    vx: float = 0.0  # m/s, fp32
    vy: float = 0.0  # m/s, fp32
    vz: float = 0.0  # m/s, fp32
    course_error: float = 0.0  # rad, fp32
    eta: int = 0  # s, uint16


class AllocatedControlTorques(Message, frozen=True):
    """Allocated Control Torques."""

    ID: ClassVar[int] = 411
    WIRE: ClassVar[str] = "ddd"

    k: float = 0.0  # Nm, fp64
    m: float = 0.0  # Nm, fp64
    n: float = 0.0  # Nm, fp64


class ControlParcel(Message, frozen=True):
    """Control Parcel."""

    ID: ClassVar[int] = 412
    WIRE: ClassVar[str] = "ffff"

    p: float = 0.0  # fp32
    i: float = 0.0  # fp32
    d: float = 0.0  # fp32
    a: float = 0.0  # fp32


class Brake(Message, frozen=True):
    """Brake."""

    ID: ClassVar[int] = 413
    WIRE: ClassVar[str] = "B"

    class Op(IntEnum):
        STOP = 0
        START = 1
        REVERT = 2

    op: int = 0  # uint8, Op


class DesiredLinearState(Message, frozen=True):
    """Desired Linear State."""

    ID: ClassVar[int] = 414
    WIRE: ClassVar[str] = "dddddddddH"

    class Flags(IntFlag):
        X = 0x001
        Y = 0x002
        Z = 0x004
        VX = 0x008
        VY = 0x010
        VZ = 0x020
        AX = 0x040
        AY = 0x080
        AZ = 0x100

    x: float = 0.0  # m, fp64
    y: float = 0.0  # m, fp64
    z: float = 0.0  # m, fp64
    vx: float = 0.0  # m/s, fp64
    vy: float = 0.0  # m/s, fp64
    vz: float = 0.0  # m/s, fp64
    ax: float = 0.0  # m/s/s, fp64
    ay: float = 0.0  # m/s/s, fp64
    az: float = 0.0  # m/s/s, fp64
    flags: int = 0  # uint16, Flags


class DesiredThrottle(Message, frozen=True):
    """Desired Throttle."""

    ID: ClassVar[int] = 415
    WIRE: ClassVar[str] = "d"

    value: float = 0.0  # %, fp64


class Goto(Message, frozen=True):
    """Goto Maneuver."""

    ID: ClassVar[int] = 450
    WIRE: ClassVar[str] = "HddfBfBdddT"

    timeout: int = 0  # s, uint16
    lat: float = 0.0  # rad, fp64, -1.5708 to 1.5708
    lon: float = 0.0  # rad, fp64, -3.14159 to 3.14159
    z: float = 0.0  # m, fp32
    z_units: int = 0  # uint8, ZUnits
    speed: float = 0.0  # fp32
    speed_units: int = 0  # uint8, SpeedUnits
    roll: float = 0.0  # rad, fp64, -1 to 6.28319
    pitch: float = 0.0  # rad, fp64, -1 to 6.28319
    yaw: float = 0.0  # rad, fp64, -1 to 6.28319
    custom: str = ""  # TupleList, plaintext


class PopUp(Message, frozen=True):
    """PopUp Maneuver."""

    ID: ClassVar[int] = 451
    WIRE: ClassVar[str] = "HddfBfBHfBT"

    class Flags(IntFlag):
        CURR_POS = 0x1
        WAIT_AT_SURFACE = 0x2
        STATION_KEEP = 0x4

    timeout: int = 0  # s, uint16
    lat: float = 0.0  # rad, fp64, -1.5708 to 1.5708
    lon: float = 0.0  # rad, fp64, -3.14159 to 3.14159
    z: float = 0.0  # m, fp32
    z_units: int = 0  # uint8, ZUnits
    speed: float = 0.0  # fp32
    speed_units: int = 0  # uint8, SpeedUnits
    duration: int = 0  # s, uint16
    radius: float = 0.0  # m, fp32, 1 to 100000
    flags: int = 0  # uint8, Flags
    custom: str = ""  # TupleList, plaintext


class Teleoperation(Message, frozen=True):
    """Teleoperation Maneuver."""

    ID: ClassVar[int] = 452
    WIRE: ClassVar[str] = "T"

    custom: str = ""  # TupleList, plaintext


class Loiter(Message, frozen=True):
    """Loiter Maneuver."""

    ID: ClassVar[int] = 453
    WIRE: ClassVar[str] = "HddfBHfBBffdBT"

    class Type(IntEnum):
        DEFAULT = 0
        CIRCULAR = 1
        RACETRACK = 2
        EIGHT = 3
        HOVER = 4

    class Direction(IntEnum):
        VDEP = 0
        CLOCKW = 1
        CCLOCKW = 2
        IWINDCURR = 3

    timeout: int = 0  # s, uint16
    lat: float = 0.0  # rad, fp64, -1.5708 to 1.5708
    lon: float = 0.0  # rad, fp64, -3.14159 to 3.14159
    z: float = 0.0  # m, fp32
    z_units: int = 0  # uint8, ZUnits
    duration: int = 0  # s, uint16
    speed: float = 0.0  # fp32
    speed_units: int = 0  # uint8, SpeedUnits
    type: int = 0  # uint8, Type, at most 4
    radius: float = 0.0  # m, fp32, 1 to 100000
    length: float = 0.0  # m, fp32, 1 to 100000
    bearing: float = 0.0  # rad, fp64, 0 to 6.28319
    direction: int = 0  # uint8, Direction, at most 3
    custom: str = ""  # TupleList, plaintext


class IdleManeuver(Message, frozen=True):
    """Idle Maneuver."""

    ID: ClassVar[int] = 454
    WIRE: ClassVar[str] = "HT"

    duration: int = 0  # s, uint16
    custom: str = ""  # TupleList, plaintext


class LowLevelControl(Message, frozen=True):
    """Low Level Control Maneuver."""

    ID: ClassVar[int] = 455
    WIRE: ClassVar[str] = "MHT"

    control: Message | None = None  # message, ControlCommand
    duration: int = 0  # s, uint16
    custom: str = ""  # TupleList, plaintext


class Rows(Message, frozen=True):
    """Rows Maneuver."""

    ID: ClassVar[int] = 456
    WIRE: ClassVar[str] = "HddfBfBddfffBBBT"

    class Flags(IntFlag):
        SQUARE_CURVE = 0x1
        CURVE_RIGHT = 0x2

    timeout: int = 0  # s, uint16
    lat: float = 0.0  # rad, fp64, -1.5708 to 1.5708
    lon: float = 0.0  # rad, fp64, -3.14159 to 3.14159
    z: float = 0.0  # m, fp32
    z_units: int = 0  # uint8, ZUnits
    speed: float = 0.0  # fp32
    speed_units: int = 0  # uint8, SpeedUnits
    bearing: float = 0.0  # rad, fp64, 0 to 6.28319
    cross_angle: float = 0.0  # rad, fp64, -1.0472 to 1.0472
    width: float = 0.0  # m, fp32, at least 0
    length: float = 0.0  # m, fp32, at least 0
    hstep: float = 0.0  # m, fp32, at least 0
    coff: int = 0  # m, uint8
    alternation: int = 0  # %, uint8, at most 100
    flags: int = 0  # uint8, Flags
    custom: str = ""  # TupleList, plaintext


class FollowPath(MessageWithLists, frozen=True):
    """Follow Path Maneuver."""

    ID: ClassVar[int] = 457
    WIRE: ClassVar[str] = "HddfBfBLT"
    LISTS: ClassVar[tuple[str, ...]] = ("points",)

    timeout: int = 0  # s, uint16
    lat: float = 0.0  # rad, fp64, -1.5708 to 1.5708
    lon: float = 0.0  # rad, fp64, -3.14159 to 3.14159
    z: float = 0.0  # m, fp32
    z_units: int = 0  # uint8, ZUnits
    speed: float = 0.0  # fp32
    speed_units: int = 0  # uint8, SpeedUnits
    points: tuple[Message | None, ...] = ()  # message-list, PathPoint
    custom: str = ""  # TupleList, plaintext


class PathPoint(Message, frozen=True):
    """Path Point."""

    ID: ClassVar[int] = 458
    WIRE: ClassVar[str] = "fff"

    x: float = 0.0  # m, fp32
    y: float = 0.0  # m, fp32
    z: float = 0.0  # m, fp32


class YoYo(Message, frozen=True):
    """Yo-Yo Maneuver."""

    ID: ClassVar[int] = 459
    WIRE: ClassVar[str] = "HddfBfffBT"

    timeout: int = 0  # s, uint16
    lat: float = 0.0  # rad, fp64, -1.5708 to 1.5708
    lon: float = 0.0  # rad, fp64, -3.14159 to 3.14159
    z: float = 0.0  # m, fp32
    z_units: int = 0  # uint8, ZUnits
    amplitude: float = 0.0  # m, fp32
    pitch: float = 0.0  # rad, fp32, 0 to 0.785398
    speed: float = 0.0  # fp32
    speed_units: int = 0  # uint8, SpeedUnits
    custom: str = ""  # TupleList, plaintext


class TeleoperationDone(Message, frozen=True):
    """Teleoperation Done."""

    ID: ClassVar[int] = 460


class StationKeeping(Message, frozen=True):
    """Station Keeping."""

    ID: ClassVar[int] = 461
    WIRE: ClassVar[str] = "ddfBfHfBT"

    lat: float = 0.0  # rad, fp64, -1.5708 to 1.5708
    lon: float = 0.0  # rad, fp64, -3.14159 to 3.14159
    z: float = 0.0  # m, fp32
    z_units: int = 0  # uint8, ZUnits
    radius: float = 0.0  # m, fp32
    duration: int = 0  # s, uint16
    speed: float = 0.0  # fp32
    speed_units: int = 0  # uint8, SpeedUnits
    custom: str = ""  # TupleList, plaintext


class Elevator(Message, frozen=True):
    """Elevator Maneuver."""

    ID: ClassVar[int] = 462
    WIRE: ClassVar[str] = "HBddfBfBffBT"

    class Flags(IntFlag):
        CURR_POS = 0x1

    timeout: int = 0  # s, uint16
    flags: int = 0  # uint8, Flags
    lat: float = 0.0  # rad, fp64, -1.5708 to 1.5708
    lon: float = 0.0  # rad, fp64, -3.14159 to 3.14159
    start_z: float = 0.0  # m, fp32
    start_z_units: int = 0  # uint8, ZUnits
    end_z: float = 0.0  # m, fp32
    end_z_units: int = 0  # uint8, ZUnits
    radius: float = 0.0  # m, fp32, at least 0
    speed: float = 0.0  # fp32
    speed_units: int = 0  # uint8, SpeedUnits
    custom: str = ""  # TupleList, plaintext


class FollowTrajectory(MessageWithLists, frozen=True):
    """Follow Trajectory."""

    ID: ClassVar[int] = 463
    WIRE: ClassVar[str] = "HddfBfBLT"
    LISTS: ClassVar[tuple[str, ...]] = ("points",)

    timeout: int = 0  # s, uint16
    lat: float = 0.0  # rad, fp64, -1.5708 to 1.5708
    lon: float = 0.0  # rad, fp64, -3.14159 to 3.14159
    z: float = 0.0  # m, fp32
    z_units: int = 0  # uint8, ZUnits
    speed: float = 0.0  # fp32
    speed_units: int = 0  # uint8, SpeedUnits
    points: tuple[Message | None, ...] = ()  # message-list, TrajectoryPoint
    custom: str = ""  # TupleList, plaintext


class TrajectoryPoint(Message, frozen=True):
    """Trajectory Point."""

    ID: ClassVar[int] = 464
    WIRE: ClassVar[str] = "ffff"

    x: float = 0.0  # m, fp32
    y: float = 0.0  # m, fp32
    z: float = 0.0  # m, fp32
    t: float = 0.0  # s, fp32


class CustomManeuver(Message, frozen=True):
    """Custom Maneuver."""

    ID: ClassVar[int] = 465
    WIRE: ClassVar[str] = "HTT"

    timeout: int = 0  # s, uint16
    name: str = ""  # plaintext
    custom: str = ""  # TupleList, plaintext


class VehicleFormation(MessageWithLists, frozen=True):
    """Vehicle Formation."""

    ID: ClassVar[int] = 466
    WIRE: ClassVar[str] = "ddfBfBLLdT"
    LISTS: ClassVar[tuple[str, ...]] = ("points", "participants")

    lat: float = 0.0  # rad, fp64, -1.5708 to 1.5708
    lon: float = 0.0  # rad, fp64, -3.14159 to 3.14159
    z: float = 0.0  # m, fp32
    z_units: int = 0  # uint8, ZUnits
    speed: float = 0.0  # fp32
    speed_units: int = 0  # uint8, SpeedUnits
    points: tuple[Message | None, ...] = ()  # message-list, TrajectoryPoint
    participants: tuple[Message | None, ...] = ()  # message-list, VehicleFormationParticipant
    start_time: float = 0.0  # s, fp64
    custom: str = ""  # TupleList, plaintext


class VehicleFormationParticipant(Message, frozen=True):
    """Vehicle Formation Participant."""

    ID: ClassVar[int] = 467
    WIRE: ClassVar[str] = "Hfff"

    vid: int = 0  # uint16
    off_x: float = 0.0  # m, fp32
    off_y: float = 0.0  # m, fp32
    off_z: float = 0.0  # m, fp32


class StopManeuver(Message, frozen=True):
    """Stop Maneuver."""

    ID: ClassVar[int] = 468


class RegisterManeuver(Message, frozen=True):
    """Register Maneuver."""

    ID: ClassVar[int] = 469
    WIRE: ClassVar[str] = "H"

    mid: int = 0  # uint16


class ManeuverControlState(Message, frozen=True):
    """Maneuver Control State."""

    ID: ClassVar[int] = 470
    WIRE: ClassVar[str] = "BHT"

    class State(IntEnum):
        EXECUTING = 0
        DONE = 1
        ERROR = 2
        STOPPED = 3

    state: int = 0  # uint8, State
    eta: int = 0  # s, uint16
    info: str = ""  # plaintext


class FollowSystem(Message, frozen=True):
    """Follow System."""

    ID: ClassVar[int] = 471
    WIRE: ClassVar[str] = "HHfBfffB"

    system: int = 0  # uint16
    duration: int = 0  # s, uint16
    speed: float = 0.0  # fp32
    speed_units: int = 0  # uint8, SpeedUnits
    x: float = 0.0  # fp32
    y: float = 0.0  # fp32
    z: float = 0.0  # fp32
    z_units: int = 0  # uint8, ZUnits


class CommsRelay(Message, frozen=True):
    """Communications Relay."""

    ID: ClassVar[int] = 472
    WIRE: ClassVar[str] = "ddfBHHHf"

    lat: float = 0.0  # rad, fp64, -1.5708 to 1.5708
    lon: float = 0.0  # rad, fp64, -3.14159 to 3.14159
    speed: float = 0.0  # fp32
    speed_units: int = 0  # uint8, SpeedUnits
    duration: int = 0  # s, uint16
    sys_a: int = 0  # uint16
    sys_b: int = 0  # uint16
    move_threshold: float = 0.0  # m, fp32


class CoverArea(MessageWithLists, frozen=True):
    """Cover Area."""

    ID: ClassVar[int] = 473
    WIRE: ClassVar[str] = "ddfBfBLT"
    LISTS: ClassVar[tuple[str, ...]] = ("polygon",)

    lat: float = 0.0  # rad, fp64, -1.5708 to 1.5708
    lon: float = 0.0  # rad, fp64, -3.14159 to 3.14159
    z: float = 0.0  # m, fp32
    z_units: int = 0  # uint8, ZUnits
    speed: float = 0.0  # fp32
    speed_units: int = 0  # uint8, SpeedUnits
    polygon: tuple[Message | None, ...] = ()  # message-list, PolygonVertex
    custom: str = ""  # TupleList, plaintext


class PolygonVertex(Message, frozen=True):
    """Polygon Vertex."""

    ID: ClassVar[int] = 474
    WIRE: ClassVar[str] = "dd"

    lat: float = 0.0  # rad, fp64, -1.5708 to 1.5708
    lon: float = 0.0  # rad, fp64, -3.14159 to 3.14159


class CompassCalibration(Message, frozen=True):
    """Compass Calibration Maneuver."""

    ID: ClassVar[int] = 475
    WIRE: ClassVar[str] = "HddfBffHfBfBT"

    class Direction(IntEnum):
        VDEP = 0
        CLOCKW = 1
        CCLOCKW = 2
        IWINDCURR = 3

    timeout: int = 0  # s, uint16
    lat: float = 0.0  # rad, fp64, -1.5708 to 1.5708
    lon: float = 0.0  # rad, fp64, -3.14159 to 3.14159
    z: float = 0.0  # m, fp32
    z_units: int = 0  # uint8, ZUnits
    pitch: float = 0.0  # rad, fp32, -1.5708 to 1.5708
    amplitude: float = 0.0  # m, fp32
    duration: int = 0  # s, uint16
    speed: float = 0.0  # fp32
    speed_units: int = 0  # uint8, SpeedUnits
    radius: float = 0.0  # m, fp32, 1 to 100000
    direction: int = 0  # uint8, Direction, at most 3
    custom: str = ""  # TupleList, plaintext


class FormationParameters(MessageWithLists, frozen=True):
    """Formation Parameters."""

    ID: ClassVar[int] = 476
    WIRE: ClassVar[str] = "TBLT"
    LISTS: ClassVar[tuple[str, ...]] = ("participants",)

    class ReferenceFrame(IntEnum):
        EARTH_FIXED = 0
        PATH_FIXED = 1
        PATH_CURVED = 2

    formation_name: str = ""  # plaintext
    reference_frame: int = 0  # uint8, ReferenceFrame
    participants: tuple[Message | None, ...] = ()  # message-list, VehicleFormationParticipant
    custom: str = ""  # TupleList, plaintext


class FormationPlanExecution(Message, frozen=True):
    """Formation Plan Execution."""

    ID: ClassVar[int] = 477
    WIRE: ClassVar[str] = "TTTTffffHfHHfT"

    group_name: str = ""  # plaintext
    formation_name: str = ""  # plaintext
    plan_id: str = ""  # plaintext
    description: str = ""  # plaintext
    leader_speed: float = 0.0  # m/s, fp32
    leader_bank_lim: float = 0.0  # m/s, fp32
    pos_sim_err_lim: float = 0.0  # m, fp32
    pos_sim_err_wrn: float = 0.0  # m, fp32
    pos_sim_err_timeout: int = 0  # s, uint16
    converg_max: float = 0.0  # m, fp32
    converg_timeout: int = 0  # s, uint16
    comms_timeout: int = 0  # s, uint16
    turb_lim: float = 0.0  # m/s, fp32
    custom: str = ""  # TupleList, plaintext


class FollowReference(Message, frozen=True):
    """Follow Reference Maneuver."""

    ID: ClassVar[int] = 478
    WIRE: ClassVar[str] = "HBfff"

    control_src: int = 0  # uint16
    control_ent: int = 0  # uint8
    timeout: float = 0.0  # fp32
    loiter_radius: float = 0.0  # fp32
    altitude_interval: float = 0.0  # fp32


class Reference(Message, frozen=True):
    """Reference To Follow."""

    ID: ClassVar[int] = 479
    WIRE: ClassVar[str] = "BMMddf"

    class Flags(IntFlag):
        LOCATION = 0x01
        SPEED = 0x02
        Z = 0x04
        RADIUS = 0x08
        START_POINT = 0x10
        DIRECT = 0x20
        MANDONE = 0x80

    flags: int = 0  # uint8, Flags
    speed: Message | None = None  # message, DesiredSpeed
    z: Message | None = None  # message, DesiredZ
    lat: float = 0.0  # fp64
    lon: float = 0.0  # fp64
    radius: float = 0.0  # fp32


class FollowRefState(Message, frozen=True):
    """Follow Reference State."""

    ID: ClassVar[int] = 480
    WIRE: ClassVar[str] = "HBMBB"

    class State(IntEnum):
        WAIT = 1
        GOTO = 2
        LOITER = 3
        HOVER = 4
        ELEVATOR = 5
        TIMEOUT = 6

    class Proximity(IntFlag):
        FAR = 0x01
        XY_NEAR = 0x02
        Z_NEAR = 0x04
        XY_UNREACHABLE = 0x08
        Z_UNREACHABLE = 0x10

    control_src: int = 0  # uint16
    control_ent: int = 0  # uint8
    reference: Message | None = None  # message, Reference
    state: int = 0  # uint8, State
    proximity: int = 0  # uint8, Proximity


class FormationMonitor(MessageWithLists, frozen=True):
    """Formation Monitoring Data."""

    ID: ClassVar[int] = 481
    WIRE: ClassVar[str] = "ffffffffffffffffffL"
    LISTS: ClassVar[tuple[str, ...]] = ("rel_state",)

    ax_cmd: float = 0.0  # fp32
    ay_cmd: float = 0.0  # fp32
    az_cmd: float = 0.0  # fp32
    ax_des: float = 0.0  # fp32
    ay_des: float = 0.0  # fp32
    az_des: float = 0.0  # fp32
    virt_err_x: float = 0.0  # fp32
    virt_err_y: float = 0.0  # fp32
    virt_err_z: float = 0.0  # fp32
    surf_fdbk_x: float = 0.0  # fp32
    surf_fdbk_y: float = 0.0  # fp32
    surf_fdbk_z: float = 0.0  # fp32
    surf_unkn_x: float = 0.0  # fp32
    surf_unkn_y: float = 0.0  # fp32
    surf_unkn_z: float = 0.0  # fp32
    ss_x: float = 0.0  # fp32
    ss_y: float = 0.0  # fp32
    ss_z: float = 0.0  # fp32
    rel_state: tuple[Message | None, ...] = ()  # message-list, RelativeState


class RelativeState(Message, frozen=True):
    """Relative State."""

    ID: ClassVar[int] = 482
    WIRE: ClassVar[str] = "Tfffffffffffffffffffff"

    s_id: str = ""  # plaintext
    dist: float = 0.0  # fp32
    err: float = 0.0  # fp32
    ctrl_imp: float = 0.0  # fp32
    rel_dir_x: float = 0.0  # fp32
    rel_dir_y: float = 0.0  # fp32
    rel_dir_z: float = 0.0  # fp32
    err_x: float = 0.0  # fp32
    err_y: float = 0.0  # fp32
    err_z: float = 0.0  # fp32
    rf_err_x: float = 0.0  # fp32
    rf_err_y: float = 0.0  # fp32
    rf_err_z: float = 0.0  # fp32
    rf_err_vx: float = 0.0  # fp32
    rf_err_vy: float = 0.0  # fp32
    rf_err_vz: float = 0.0  # fp32
    ss_x: float = 0.0  # fp32
    ss_y: float = 0.0  # fp32
    ss_z: float = 0.0  # fp32
    virt_err_x: float = 0.0  # fp32
    virt_err_y: float = 0.0  # fp32
    virt_err_z: float = 0.0  # fp32


class Dislodge(Message, frozen=True):
    """Dislodge Maneuver."""

    ID: ClassVar[int] = 483
    WIRE: ClassVar[str] = "HfBT"

    class Direction(IntEnum):
        AUTO = 0
        FORWARD = 1
        BACKWARD = 2

    timeout: int = 0  # s, uint16
    rpm: float = 0.0  # fp32
    direction: int = 0  # uint8, Direction
    custom: str = ""  # TupleList, plaintext


class Formation(MessageWithLists, frozen=True):
    """Formation."""

    ID: ClassVar[int] = 484
    WIRE: ClassVar[str] = "TBBTTTBLfffffffHfHHfT"
    LISTS: ClassVar[tuple[str, ...]] = ("participants",)

    class Type(IntEnum):
        REQUEST = 0
        REPORT = 1

    class Op(IntEnum):
        START = 0
        STOP = 1
        READY = 2
        EXECUTING = 3
        FAILURE = 4

    class ReferenceFrame(IntEnum):
        EARTH_FIXED = 0
        PATH_FIXED = 1
        PATH_CURVED = 2

    formation_name: str = ""  # plaintext
    type: int = 0  # uint8, Type
    op: int = 0  # uint8, Op
    group_name: str = ""  # plaintext
    plan_id: str = ""  # plaintext
    description: str = ""  # plaintext
    reference_frame: int = 0  # uint8, ReferenceFrame
    participants: tuple[Message | None, ...] = ()  # message-list, VehicleFormationParticipant
    leader_bank_lim: float = 0.0  # rad, fp32
    leader_speed_min: float = 0.0  # m/s, fp32
    leader_speed_max: float = 0.0  # m/s, fp32
    leader_alt_min: float = 0.0  # m, fp32
    leader_alt_max: float = 0.0  # m, fp32
    pos_sim_err_lim: float = 0.0  # m, fp32
    pos_sim_err_wrn: float = 0.0  # m, fp32
    pos_sim_err_timeout: int = 0  # s, uint16
    converg_max: float = 0.0  # m, fp32
    converg_timeout: int = 0  # s, uint16
    comms_timeout: int = 0  # s, uint16
    turb_lim: float = 0.0  # m/s, fp32
    custom: str = ""  # TupleList, plaintext


class Launch(Message, frozen=True):
    """Launch Maneuver."""

    ID: ClassVar[int] = 485
    WIRE: ClassVar[str] = "HddfBfBT"

    timeout: int = 0  # s, uint16
    lat: float = 0.0  # rad, fp64, -1.5708 to 1.5708
    lon: float = 0.0  # rad, fp64, -3.14159 to 3.14159
    z: float = 0.0  # m, fp32
    z_units: int = 0  # uint8, ZUnits
    speed: float = 0.0  # fp32
    speed_units: int = 0  # uint8, SpeedUnits
    custom: str = ""  # TupleList, plaintext


class Drop(Message, frozen=True):
    """Drop Maneuver."""

    ID: ClassVar[int] = 486
    WIRE: ClassVar[str] = "HddfBfBT"

    timeout: int = 0  # s, uint16
    lat: float = 0.0  # rad, fp64, -1.5708 to 1.5708
    lon: float = 0.0  # rad, fp64, -3.14159 to 3.14159
    z: float = 0.0  # m, fp32
    z_units: int = 0  # uint8, ZUnits
    speed: float = 0.0  # fp32
    speed_units: int = 0  # uint8, SpeedUnits
    custom: str = ""  # TupleList, plaintext


class ScheduledGoto(Message, frozen=True):
    """Scheduled Goto."""

    ID: ClassVar[int] = 487
    WIRE: ClassVar[str] = "dddfBfBB"

    class Delayed(IntEnum):
        RESUME = 0
        SKIP = 1
        FAIL = 2

    arrival_time: float = 0.0  # s, fp64
    lat: float = 0.0  # rad, fp64, -1.5708 to 1.5708
    lon: float = 0.0  # rad, fp64, -3.14159 to 3.14159
    z: float = 0.0  # m, fp32
    z_units: int = 0  # uint8, ZUnits
    travel_z: float = 0.0  # m, fp32
    travel_z_units: int = 0  # uint8, ZUnits
    delayed: int = 0  # uint8, Delayed


class RowsCoverage(Message, frozen=True):
    """Rows Coverage."""

    ID: ClassVar[int] = 488
    WIRE: ClassVar[str] = "ddfBfBddffBfHBBT"

    class Flags(IntFlag):
        SQUARE_CURVE = 0x1
        CURVE_RIGHT = 0x2

    lat: float = 0.0  # rad, fp64, -1.5708 to 1.5708
    lon: float = 0.0  # rad, fp64, -3.14159 to 3.14159
    z: float = 0.0  # m, fp32
    z_units: int = 0  # uint8, ZUnits
    speed: float = 0.0  # fp32
    speed_units: int = 0  # uint8, SpeedUnits
    bearing: float = 0.0  # rad, fp64, 0 to 6.28319
    cross_angle: float = 0.0  # rad, fp64, -1.0472 to 1.0472
    width: float = 0.0  # m, fp32, at least 0
    length: float = 0.0  # m, fp32, at least 0
    coff: int = 0  # m, uint8
    angaperture: float = 0.0  # rad, fp32, -3.14159 to 3.14159
    range: int = 0  # m, uint16
    overlap: int = 0  # %, uint8, at most 100
    flags: int = 0  # uint8, Flags
    custom: str = ""  # TupleList, plaintext


class Sample(Message, frozen=True):
    """Sample Maneuver."""

    ID: ClassVar[int] = 489
    WIRE: ClassVar[str] = "HddfBfBBBBT"

    timeout: int = 0  # s, uint16
    lat: float = 0.0  # rad, fp64, -1.5708 to 1.5708
    lon: float = 0.0  # rad, fp64, -3.14159 to 3.14159
    z: float = 0.0  # m, fp32
    z_units: int = 0  # uint8, ZUnits
    speed: float = 0.0  # fp32
    speed_units: int = 0  # uint8, SpeedUnits
    syringe0: int = 0  # uint8, Boolean
    syringe1: int = 0  # uint8, Boolean
    syringe2: int = 0  # uint8, Boolean
    custom: str = ""  # TupleList, plaintext


class ImageTracking(Message, frozen=True):
    """Image Tracking."""

    ID: ClassVar[int] = 490


class Takeoff(Message, frozen=True):
    """Takeoff Maneuver."""

    ID: ClassVar[int] = 491
    WIRE: ClassVar[str] = "ddfBfBfT"

    lat: float = 0.0  # rad, fp64, -1.5708 to 1.5708
    lon: float = 0.0  # rad, fp64, -3.14159 to 3.14159
    z: float = 0.0  # m, fp32
    z_units: int = 0  # uint8, ZUnits
    speed: float = 0.0  # fp32
    speed_units: int = 0  # uint8, SpeedUnits
    takeoff_pitch: float = 0.0  # rad, fp32, 0 to 1.5708
    custom: str = ""  # TupleList, plaintext


class Land(Message, frozen=True):
    """Land Maneuver."""

    ID: ClassVar[int] = 492
    WIRE: ClassVar[str] = "ddfBfBfdBfT"

    lat: float = 0.0  # rad, fp64, -1.5708 to 1.5708
    lon: float = 0.0  # rad, fp64, -3.14159 to 3.14159
    z: float = 0.0  # m, fp32
    z_units: int = 0  # uint8, ZUnits
    speed: float = 0.0  # fp32
    speed_units: int = 0  # uint8, SpeedUnits
    abort_z: float = 0.0  # m, fp32
    bearing: float = 0.0  # rad, fp64, 0 to 6.28319
    glide_slope: int = 0  # %, uint8, at most 10
    glide_slope_alt: float = 0.0  # m, fp32
    custom: str = ""  # TupleList, plaintext


class AutonomousSection(MessageWithLists, frozen=True):
    """Autonomous Section."""

    ID: ClassVar[int] = 493
    WIRE: ClassVar[str] = "ddfBBdddLTT"
    LISTS: ClassVar[tuple[str, ...]] = ("area_limits",)

    class Limits(IntFlag):
        DEPTH = 0x1
        ALTITUDE = 0x2
        TIMEOUT = 0x4
        AREA2D = 0x8

    lat: float = 0.0  # rad, fp64, -1.5708 to 1.5708
    lon: float = 0.0  # rad, fp64, -3.14159 to 3.14159
    speed: float = 0.0  # fp32
    speed_units: int = 0  # uint8, SpeedUnits
    limits: int = 0  # uint8, Limits
    max_depth: float = 0.0  # m, fp64
    min_alt: float = 0.0  # m, fp64
    time_limit: float = 0.0  # s, fp64
    area_limits: tuple[Message | None, ...] = ()  # message-list, PolygonVertex
    controller: str = ""  # plaintext
    custom: str = ""  # TupleList, plaintext


class FollowPoint(Message, frozen=True):
    """Follow Point Maneuver."""

    ID: ClassVar[int] = 494
    WIRE: ClassVar[str] = "TfBddfBT"

    target: str = ""  # plaintext
    max_speed: float = 0.0  # m/s, fp32, at least 0
    speed_units: int = 0  # uint8, SpeedUnits
    lat: float = 0.0  # rad, fp64, -1.5708 to 1.5708
    lon: float = 0.0  # rad, fp64, -3.14159 to 3.14159
    z: float = 0.0  # m, fp32
    z_units: int = 0  # uint8, ZUnits
    custom: str = ""  # TupleList, plaintext


class Alignment(Message, frozen=True):
    """Alignment Maneuver."""

    ID: ClassVar[int] = 495
    WIRE: ClassVar[str] = "HddfBT"

    timeout: int = 0  # s, uint16
    lat: float = 0.0  # rad, fp64, -1.5708 to 1.5708
    lon: float = 0.0  # rad, fp64, -3.14159 to 3.14159
    speed: float = 0.0  # fp32
    speed_units: int = 0  # uint8, SpeedUnits
    custom: str = ""  # TupleList, plaintext


class StationKeepingExtended(Message, frozen=True):
    """Station Keeping Extended."""

    ID: ClassVar[int] = 496
    WIRE: ClassVar[str] = "ddfBfHfBHHBT"

    class Flags(IntFlag):
        KEEP_SAFE = 0x1

    lat: float = 0.0  # rad, fp64, -1.5708 to 1.5708
    lon: float = 0.0  # rad, fp64, -3.14159 to 3.14159
    z: float = 0.0  # m, fp32
    z_units: int = 0  # uint8, ZUnits
    radius: float = 0.0  # m, fp32
    duration: int = 0  # s, uint16
    speed: float = 0.0  # fp32
    speed_units: int = 0  # uint8, SpeedUnits
    popup_period: int = 0  # s, uint16
    popup_duration: int = 0  # s, uint16
    flags: int = 0  # uint8, Flags
    custom: str = ""  # TupleList, plaintext


class ManeuverDone(Message, frozen=True):
    """Maneuver Done."""

    ID: ClassVar[int] = 497


class Magnetometer(Message, frozen=True):
    """Magnetometer Maneuver."""

    ID: ClassVar[int] = 499
    WIRE: ClassVar[str] = "HddfBfBdfBT"

    class Direction(IntEnum):
        CLOCKW_FIRST = 0
        CCLOCKW_FIRST = 1

    timeout: int = 0  # s, uint16
    lat: float = 0.0  # rad, fp64, -1.5708 to 1.5708
    lon: float = 0.0  # rad, fp64, -3.14159 to 3.14159
    z: float = 0.0  # m, fp32
    z_units: int = 0  # uint8, ZUnits
    speed: float = 0.0  # fp32
    speed_units: int = 0  # uint8, SpeedUnits
    bearing: float = 0.0  # rad, fp64, 0 to 6.28319
    width: float = 0.0  # m, fp32, at least 50
    direction: int = 0  # uint8, Direction, at most 1
    custom: str = ""  # TupleList, plaintext


class VehicleState(Message, frozen=True):
    """Vehicle State."""

    ID: ClassVar[int] = 500
    WIRE: ClassVar[str] = "BBTHdHIBTd"

    class OpMode(IntEnum):
        SERVICE = 0
        CALIBRATION = 1
        ERROR = 2
        MANEUVER = 3
        EXTERNAL = 4
        BOOT = 5

    class Flags(IntFlag):
        MANEUVER_DONE = 0x1

    op_mode: int = 0  # uint8, OpMode
    error_count: int = 0  # uint8
    error_ents: str = ""  # plaintext
    maneuver_type: int = 0  # uint16
    maneuver_stime: float = 0.0  # s, fp64
    maneuver_eta: int = 0  # s, uint16
    control_loops: int = 0  # uint32, CLoopsMask
    flags: int = 0  # uint8, Flags
    last_error: str = ""  # plaintext
    last_error_time: float = 0.0  # s, fp64


class VehicleCommand(Message, frozen=True):
    """Vehicle Command."""

    ID: ClassVar[int] = 501
    WIRE: ClassVar[str] = "BHBMHT"

    class Type(IntEnum):
        REQUEST = 0
        SUCCESS = 1
        IN_PROGRESS = 2
        FAILURE = 3

    class Command(IntEnum):
        EXEC_MANEUVER = 0
        STOP_MANEUVER = 1
        START_CALIBRATION = 2
        STOP_CALIBRATION = 3

    type: int = 0  # uint8, Type
    request_id: int = 0  # uint16
    command: int = 0  # uint8, Command
    maneuver: Message | None = None  # message, Maneuver
    calib_time: int = 0  # s, uint16
    info: str = ""  # plaintext


class MonitorEntityState(Message, frozen=True):
    """Monitor Entity State."""

    ID: ClassVar[int] = 502
    WIRE: ClassVar[str] = "BT"

    class Command(IntEnum):
        RESET = 0
        ENABLE = 1
        DISABLE = 2
        ENABLE_EXCLUSIVE = 3
        STATUS = 4

    command: int = 0  # uint8, Command
    entities: str = ""  # plaintext


class EntityMonitoringState(Message, frozen=True):
    """Entity Monitoring State."""

    ID: ClassVar[int] = 503
    WIRE: ClassVar[str] = "BTBTBTTd"

    mcount: int = 0  # uint8
    mnames: str = ""  # plaintext
    ecount: int = 0  # uint8
    enames: str = ""  # plaintext
    ccount: int = 0  # uint8
    cnames: str = ""  # plaintext
    last_error: str = ""  # plaintext
    last_error_time: float = 0.0  # s, fp64


class OperationalLimits(Message, frozen=True):
    """Operational Limits."""

    ID: ClassVar[int] = 504
    WIRE: ClassVar[str] = "Bffffffddfff"

    mask: int = 0  # uint8, OpLimitsMask
    max_depth: float = 0.0  # m, fp32, at least 0
    min_altitude: float = 0.0  # m, fp32, at least 0
    max_altitude: float = 0.0  # m, fp32, at least 0
    min_speed: float = 0.0  # m/s, fp32, at least 0
    max_speed: float = 0.0  # m/s, fp32, at least 0
    max_vrate: float = 0.0  # m/s, fp32, at least 0
    lat: float = 0.0  # rad, fp64, -1.5708 to 1.5708
    lon: float = 0.0  # rad, fp64, -3.14159 to 3.14159
    orientation: float = 0.0  # rad, fp32
    width: float = 0.0  # m, fp32
    length: float = 0.0  # m, fp32


class GetOperationalLimits(Message, frozen=True):
    """Get Operational Limits."""

    ID: ClassVar[int] = 505


class Calibration(Message, frozen=True):
    """Calibration."""

    ID: ClassVar[int] = 506
    WIRE: ClassVar[str] = "H"

    duration: int = 0  # s, uint16


class ControlLoops(Message, frozen=True):
    """Control Loops."""

    ID: ClassVar[int] = 507
    WIRE: ClassVar[str] = "BII"

    class Enable(IntEnum):
        DISABLE = 0
        ENABLE = 1

    enable: int = 0  # uint8, Enable
    mask: int = 0  # uint32, CLoopsMask
    scope_ref: int = 0  # uint32


class VehicleMedium(Message, frozen=True):
    """Vehicle Medium."""

    ID: ClassVar[int] = 508
    WIRE: ClassVar[str] = "B"

    class Medium(IntEnum):
        GROUND = 0
        AIR = 1
        WATER = 2
        UNDERWATER = 3
        UNKNOWN = 4

    medium: int = 0  # uint8, Medium


class Collision(Message, frozen=True):
    """Collision."""

    ID: ClassVar[int] = 509
    WIRE: ClassVar[str] = "fB"

    class Type(IntFlag):
        X = 0x1
        Y = 0x2
        Z = 0x4
        IMPACT = 0x8

    value: float = 0.0  # m/s/s, fp32
    type: int = 0  # uint8, Type


class FormState(Message, frozen=True):
    """Formation Tracking State."""

    ID: ClassVar[int] = 510
    WIRE: ClassVar[str] = "fffBBB"

    class PosSimMon(IntEnum):
        OK = 0
        WRN = 1
        LIM = 2

    class CommMon(IntEnum):
        OK = 0
        TIMEOUT = 1

    class ConvergMon(IntEnum):
        OK = 0
        TIMEOUT = 1

    possimerr: float = 0.0  # m, fp32
    converg: float = 0.0  # m, fp32
    turbulence: float = 0.0  # m/s/s, fp32
    possimmon: int = 0  # uint8, PosSimMon
    commmon: int = 0  # uint8, CommMon
    convergmon: int = 0  # uint8, ConvergMon


class AutopilotMode(Message, frozen=True):
    """Autopilot Mode."""

    ID: ClassVar[int] = 511
    WIRE: ClassVar[str] = "BT"

    class Autonomy(IntEnum):
        MANUAL = 0
        ASSISTED = 1
        AUTO = 2

    autonomy: int = 0  # uint8, Autonomy
    mode: str = ""  # plaintext


class FormationState(Message, frozen=True):
    """Formation Tracking State."""

    ID: ClassVar[int] = 512
    WIRE: ClassVar[str] = "BBfffBBB"

    class Type(IntEnum):
        REQUEST = 0
        REPORT = 1

    class Op(IntEnum):
        START = 0
        STOP = 1

    class PosSimMon(IntEnum):
        OK = 0
        WRN = 1
        LIM = 2

    class CommMon(IntEnum):
        OK = 0
        TIMEOUT = 1

    class ConvergMon(IntEnum):
        OK = 0
        TIMEOUT = 1

    type: int = 0  # uint8, Type
    op: int = 0  # uint8, Op
    possimerr: float = 0.0  # m, fp32
    converg: float = 0.0  # m, fp32
    turbulence: float = 0.0  # m/s/s, fp32
    possimmon: int = 0  # uint8, PosSimMon
    commmon: int = 0  # uint8, CommMon
    convergmon: int = 0  # uint8, ConvergMon


class ReportControl(Message, frozen=True):
    """Report Control."""

    ID: ClassVar[int] = 513
    WIRE: ClassVar[str] = "BBHT"

    class Op(IntEnum):
        REQUEST_START = 0
        STARTED = 1
        REQUEST_STOP = 2
        STOPPED = 3
        REQUEST_REPORT = 4
        REPORT_SENT = 5

    class CommInterface(IntFlag):
        ACOUSTIC = 0x01
        SATELLITE = 0x02
        GSM = 0x04
        MOBILE = 0x08
        RADIO = 0x10

    op: int = 0  # uint8, Op
    comm_interface: int = 0  # uint8, CommInterface
    period: int = 0  # s, uint16
    sys_dst: str = ""  # plaintext


class StateReport(Message, frozen=True):
    """State Report."""

    ID: ClassVar[int] = 514
    WIRE: ClassVar[str] = "IffHHHhbbH"

    class Altitude(IntEnum):
        ALT_UNKNOWN = 65535

    class Depth(IntEnum):
        DEP_UNKNOWN = 65535

    class Fuel(IntEnum):
        FUEL_UNKNOWN = -1

    class ExecState(IntEnum):
        STATE_SERVICE = -1
        STATE_BOOT = -2
        STATE_CALIBRATION = -3
        STATE_ERROR = -4

    stime: int = 0  # s, uint32
    latitude: float = 0.0  # °, fp32
    longitude: float = 0.0  # °, fp32
    altitude: int = 0  # uint16, Altitude
    depth: int = 0  # uint16, Depth
    heading: int = 0  # uint16
    speed: int = 0  # cm/s, int16
    fuel: int = 0  # int8, Fuel
    exec_state: int = 0  # int8, ExecState
    plan_checksum: int = 0  # uint16


class TransmissionRequest(Message, frozen=True):
    """Transmission Request."""

    ID: ClassVar[int] = 515
    WIRE: ClassVar[str] = "HBTdfBMTR"

    class CommMean(IntEnum):
        WIFI = 0
        ACOUSTIC = 1
        SATELLITE = 2
        GSM = 3
        ANY = 4
        ALL = 5

    class DataMode(IntEnum):
        INLINEMSG = 0
        TEXT = 1
        RAW = 2
        ABORT = 3
        RANGE = 4
        REVERSE_RANGE = 5

    req_id: int = 0  # uint16
    comm_mean: int = 0  # uint8, CommMean
    destination: str = ""  # plaintext
    deadline: float = 0.0  # fp64
    range: float = 0.0  # m, fp32
    data_mode: int = 0  # uint8, DataMode
    msg_data: Message | None = None  # message
    txt_data: str = ""  # plaintext
    raw_data: bytes = b""  # rawdata


class TransmissionStatus(Message, frozen=True):
    """Transmission Status."""

    ID: ClassVar[int] = 516
    WIRE: ClassVar[str] = "HBfT"

    class Status(IntEnum):
        IN_PROGRESS = 0
        SENT = 1
        DELIVERED = 51
        MAYBE_DELIVERED = 52
        RANGE_RECEIVED = 60
        INPUT_FAILURE = 101
        TEMPORARY_FAILURE = 102
        PERMANENT_FAILURE = 103
        INV_ADDR = 104

    req_id: int = 0  # uint16
    status: int = 0  # uint8, Status
    range: float = 0.0  # m, fp32
    info: str = ""  # plaintext


class SmsRequest(Message, frozen=True):
    """SMS Transmission Request."""

    ID: ClassVar[int] = 517
    WIRE: ClassVar[str] = "HTdT"

    req_id: int = 0  # uint16
    destination: str = ""  # plaintext
    timeout: float = 0.0  # s, fp64
    sms_text: str = ""  # plaintext


class SmsStatus(Message, frozen=True):
    """SMS Transmission Status."""

    ID: ClassVar[int] = 518
    WIRE: ClassVar[str] = "HBT"

    class Status(IntEnum):
        QUEUED = 0
        SENT = 1
        INPUT_FAILURE = 101
        ERROR = 102

    req_id: int = 0  # uint16
    status: int = 0  # uint8, Status
    info: str = ""  # plaintext


class VtolState(Message, frozen=True):
    """VTOL State."""

    ID: ClassVar[int] = 519
    WIRE: ClassVar[str] = "B"

    class State(IntEnum):
        UNDEFINED = 0
        TRANSITION_TO_FW = 1
        TRANSITION_TO_MC = 2
        MC = 3
        FW = 4

    state: int = 0  # uint8, State


class ArmingState(Message, frozen=True):
    """Arming State."""

    ID: ClassVar[int] = 520
    WIRE: ClassVar[str] = "B"

    class State(IntEnum):
        ARMED = 0
        DISARMED = 1

    state: int = 0  # uint8, State


class TCPRequest(Message, frozen=True):
    """TCP Transmission Request."""

    ID: ClassVar[int] = 521
    WIRE: ClassVar[str] = "HTdM"

    req_id: int = 0  # uint16
    destination: str = ""  # plaintext
    timeout: float = 0.0  # s, fp64
    msg_data: Message | None = None  # message


class TCPStatus(Message, frozen=True):
    """TCP Transmission Status."""

    ID: ClassVar[int] = 522
    WIRE: ClassVar[str] = "HBT"

    class Status(IntEnum):
        QUEUED = 0
        SENT = 1
        INPUT_FAILURE = 100
        HOST_UNKNOWN = 101
        CANT_CONNECT = 102
        ERROR = 103

    req_id: int = 0  # uint16
    status: int = 0  # uint8, Status
    info: str = ""  # plaintext


class AssetReport(MessageWithLists, frozen=True):
    """Asset Report ."""

    ID: ClassVar[int] = 525
    WIRE: ClassVar[str] = "TdBddffffL"
    LISTS: ClassVar[tuple[str, ...]] = ("msgs",)

    class Medium(IntEnum):
        WIFI = 1
        SATELLITE = 2
        ACOUSTIC = 3
        SMS = 4
        MQTT = 5

    name: str = ""  # plaintext
    report_time: float = 0.0  # s, fp64
    medium: int = 0  # uint8, Medium
    lat: float = 0.0  # rad, fp64
    lon: float = 0.0  # rad, fp64
    depth: float = 0.0  # m, fp32
    alt: float = 0.0  # m, fp32
    sog: float = 0.0  # m/s, fp32
    cog: float = 0.0  # rad, fp32
    msgs: tuple[Message | None, ...] = ()  # message-list


class Abort(Message, frozen=True):
    """Abort."""

    ID: ClassVar[int] = 550


class PlanSpecification(MessageWithLists, frozen=True):
    """Plan Specification."""

    ID: ClassVar[int] = 551
    WIRE: ClassVar[str] = "TTTLTLLLL"
    LISTS: ClassVar[tuple[str, ...]] = ("variables", "maneuvers", "transitions", "start_actions", "end_actions")

    plan_id: str = ""  # plaintext
    description: str = ""  # plaintext
    vnamespace: str = ""  # plaintext
    variables: tuple[Message | None, ...] = ()  # message-list, PlanVariable
    start_man_id: str = ""  # plaintext
    maneuvers: tuple[Message | None, ...] = ()  # message-list, PlanManeuver
    transitions: tuple[Message | None, ...] = ()  # message-list, PlanTransition
    start_actions: tuple[Message | None, ...] = ()  # message-list
    end_actions: tuple[Message | None, ...] = ()  # message-list


class PlanManeuver(MessageWithLists, frozen=True):
    """Plan Maneuver."""

    ID: ClassVar[int] = 552
    WIRE: ClassVar[str] = "TMLL"
    LISTS: ClassVar[tuple[str, ...]] = ("start_actions", "end_actions")

    maneuver_id: str = ""  # plaintext
    data: Message | None = None  # message, Maneuver
    start_actions: tuple[Message | None, ...] = ()  # message-list
    end_actions: tuple[Message | None, ...] = ()  # message-list


class PlanTransition(MessageWithLists, frozen=True):
    """Plan Transition."""

    ID: ClassVar[int] = 553
    WIRE: ClassVar[str] = "TTTL"
    LISTS: ClassVar[tuple[str, ...]] = ("actions",)

    source_man: str = ""  # plaintext
    dest_man: str = ""  # plaintext
    conditions: str = ""  # plaintext
    actions: tuple[Message | None, ...] = ()  # message-list


class EmergencyControl(Message, frozen=True):
    """Emergency Control."""

    ID: ClassVar[int] = 554
    WIRE: ClassVar[str] = "BM"

    class Command(IntEnum):
        ENABLE = 0
        DISABLE = 1
        START = 2
        STOP = 3
        QUERY = 4
        SET_PLAN = 5

    command: int = 0  # uint8, Command
    plan: Message | None = None  # message, PlanSpecification


class EmergencyControlState(Message, frozen=True):
    """Emergency Control State."""

    ID: ClassVar[int] = 555
    WIRE: ClassVar[str] = "BTB"

    class State(IntEnum):
        NOT_CONFIGURED = 0
        DISABLED = 1
        ENABLED = 2
        ARMED = 3
        ACTIVE = 4
        STOPPING = 5

    state: int = 0  # uint8, State
    plan_id: str = ""  # plaintext
    comm_level: int = 0  # %, uint8, at most 100


class PlanDB(Message, frozen=True):
    """Plan DB."""

    ID: ClassVar[int] = 556
    WIRE: ClassVar[str] = "BBHTMT"

    class Type(IntEnum):
        REQUEST = 0
        SUCCESS = 1
        FAILURE = 2
        IN_PROGRESS = 3

    class Op(IntEnum):
        SET = 0
        DEL = 1
        GET = 2
        GET_INFO = 3
        CLEAR = 4
        GET_STATE = 5
        GET_DSTATE = 6
        BOOT = 7

    type: int = 0  # uint8, Type
    op: int = 0  # uint8, Op
    request_id: int = 0  # uint16
    plan_id: str = ""  # plaintext
    arg: Message | None = None  # message
    info: str = ""  # plaintext


class PlanDBState(MessageWithLists, frozen=True):
    """Plan DB State."""

    ID: ClassVar[int] = 557
    WIRE: ClassVar[str] = "HIdHTRL"
    LISTS: ClassVar[tuple[str, ...]] = ("plans_info",)

    plan_count: int = 0  # uint16
    plan_size: int = 0  # uint32
    change_time: float = 0.0  # s, fp64
    change_sid: int = 0  # uint16
    change_sname: str = ""  # plaintext
    md5: bytes = b""  # rawdata
    plans_info: tuple[Message | None, ...] = ()  # message-list, PlanDBInformation


class PlanDBInformation(Message, frozen=True):
    """Plan DB Information."""

    ID: ClassVar[int] = 558
    WIRE: ClassVar[str] = "THdHTR"

    plan_id: str = ""  # plaintext
    plan_size: int = 0  # uint16
    change_time: float = 0.0  # fp64
    change_sid: int = 0  # uint16
    change_sname: str = ""  # plaintext
    md5: bytes = b""  # rawdata


class PlanControl(Message, frozen=True):
    """Plan Control."""

    ID: ClassVar[int] = 559
    WIRE: ClassVar[str] = "BBHTHMT"

    class Type(IntEnum):
        REQUEST = 0
        SUCCESS = 1
        FAILURE = 2
        IN_PROGRESS = 3

    class Op(IntEnum):
        START = 0
        STOP = 1
        LOAD = 2
        GET = 3

    class Flags(IntFlag):
        CALIBRATE = 0x1
        IGNORE_ERRORS = 0x2

    type: int = 0  # uint8, Type
    op: int = 0  # uint8, Op
    request_id: int = 0  # uint16
    plan_id: str = ""  # plaintext
    flags: int = 0  # uint16, Flags
    arg: Message | None = None  # message
    info: str = ""  # plaintext


class PlanControlState(Message, frozen=True):
    """Plan Control State."""

    ID: ClassVar[int] = 560
    WIRE: ClassVar[str] = "BTifTHiB"

    class State(IntEnum):
        BLOCKED = 0
        READY = 1
        INITIALIZING = 2
        EXECUTING = 3

    class LastOutcome(IntEnum):
        NONE = 0
        SUCCESS = 1
        FAILURE = 2

    state: int = 0  # uint8, State
    plan_id: str = ""  # plaintext
    plan_eta: int = 0  # s, int32
    plan_progress: float = 0.0  # %, fp32
    man_id: str = ""  # plaintext
    man_type: int = 0  # uint16
    man_eta: int = 0  # s, int32
    last_outcome: int = 0  # uint8, LastOutcome


class PlanVariable(Message, frozen=True):
    """Plan Variable."""

    ID: ClassVar[int] = 561
    WIRE: ClassVar[str] = "TTBB"

    class Type(IntEnum):
        BOOLEAN = 0
        NUMBER = 1
        TEXT = 2
        MESSAGE = 3

    class Access(IntEnum):
        INPUT = 0
        OUTPUT = 1
        LOCAL = 2

    name: str = ""  # plaintext
    value: str = ""  # plaintext
    type: int = 0  # uint8, Type
    access: int = 0  # uint8, Access


class PlanGeneration(Message, frozen=True):
    """Plan Generation."""

    ID: ClassVar[int] = 562
    WIRE: ClassVar[str] = "BBTT"

    class Cmd(IntEnum):
        GENERATE = 0
        EXECUTE = 1

    class Op(IntEnum):
        REQUEST = 0
        ERROR = 1
        SUCCESS = 2

    cmd: int = 0  # uint8, Cmd
    op: int = 0  # uint8, Op
    plan_id: str = ""  # plaintext
    params: str = ""  # TupleList, plaintext


class LeaderState(Message, frozen=True):
    """Leader State."""

    ID: ClassVar[int] = 563
    WIRE: ClassVar[str] = "TBddffffffffffffffff"

    class Op(IntEnum):
        REQUEST = 0
        SET = 1
        REPORT = 2

    group_name: str = ""  # plaintext
    op: int = 0  # uint8, Op
    lat: float = 0.0  # rad, fp64, -1.5708 to 1.5708
    lon: float = 0.0  # rad, fp64, -3.14159 to 3.14159
    height: float = 0.0  # m, fp32
    x: float = 0.0  # m, fp32
    y: float = 0.0  # m, fp32
    z: float = 0.0  # m, fp32
    phi: float = 0.0  # rad, fp32, -3.14159 to 3.14159
    theta: float = 0.0  # rad, fp32, -1.5708 to 1.5708
    psi: float = 0.0  # rad, fp32, -3.14159 to 3.14159
    vx: float = 0.0  # m/s, fp32
    vy: float = 0.0  # m/s, fp32
    vz: float = 0.0  # m/s, fp32
    p: float = 0.0  # rad/s, fp32, -3.14159 to 3.14159
    q: float = 0.0  # rad/s, fp32, -3.14159 to 3.14159
    r: float = 0.0  # rad/s, fp32, -3.14159 to 3.14159
    svx: float = 0.0  # m/s, fp32
    svy: float = 0.0  # m/s, fp32
    svz: float = 0.0  # m/s, fp32


class PlanStatistics(Message, frozen=True):
    """Plan Statistics."""

    ID: ClassVar[int] = 564
    WIRE: ClassVar[str] = "TBBTTTT"

    class Type(IntEnum):
        PREPLAN = 0
        INPLAN = 1
        POSTPLAN = 2

    class Properties(IntFlag):
        BASIC = 0x0
        NONLINEAR = 0x1
        INFINITE = 0x2
        CYCLICAL = 0x4
        ALL = 0x7

    plan_id: str = ""  # plaintext
    type: int = 0  # uint8, Type
    properties: int = 0  # uint8, Properties
    durations: str = ""  # TupleList, plaintext
    distances: str = ""  # TupleList, plaintext
    actions: str = ""  # TupleList, plaintext
    fuel: str = ""  # TupleList, plaintext


class ReportedState(Message, frozen=True):
    """Reported State."""

    ID: ClassVar[int] = 600
    WIRE: ClassVar[str] = "dddddddTB"

    class SType(IntEnum):
        WI_FI = 0
        TRACKER = 1
        SMS = 2
        ACOUSTIC_MODEM = 3
        UNKNOWN = 254

    lat: float = 0.0  # rad, fp64
    lon: float = 0.0  # rad, fp64
    depth: float = 0.0  # m, fp64
    roll: float = 0.0  # rad, fp64
    pitch: float = 0.0  # rad, fp64
    yaw: float = 0.0  # rad, fp64
    rcp_time: float = 0.0  # s, fp64
    sid: str = ""  # plaintext
    s_type: int = 0  # uint8, SType


class RemoteSensorInfo(Message, frozen=True):
    """Remote Sensor Info."""

    ID: ClassVar[int] = 601
    WIRE: ClassVar[str] = "TTddffT"

    id: str = ""  # plaintext
    sensor_class: str = ""  # plaintext
    lat: float = 0.0  # rad, fp64
    lon: float = 0.0  # rad, fp64
    alt: float = 0.0  # m, fp32
    heading: float = 0.0  # rad, fp32
    data: str = ""  # TupleList, plaintext


class Map(MessageWithLists, frozen=True):
    """Map."""

    ID: ClassVar[int] = 602
    WIRE: ClassVar[str] = "TL"
    LISTS: ClassVar[tuple[str, ...]] = ("features",)

    id: str = ""  # plaintext
    features: tuple[Message | None, ...] = ()  # message-list, MapFeature


class MapFeature(MessageWithLists, frozen=True):
    """Map Feature."""

    ID: ClassVar[int] = 603
    WIRE: ClassVar[str] = "TBBBBL"
    LISTS: ClassVar[tuple[str, ...]] = ("feature",)

    class FeatureType(IntEnum):
        POI = 0
        FILLEDPOLY = 1
        CONTOUREDPOLY = 2
        LINE = 3
        TRANSPONDER = 4
        STARTLOC = 5
        HOMEREF = 6

    id: str = ""  # plaintext
    feature_type: int = 0  # uint8, FeatureType
    rgb_red: int = 0  # uint8
    rgb_green: int = 0  # uint8
    rgb_blue: int = 0  # uint8
    feature: tuple[Message | None, ...] = ()  # message-list, MapPoint


class MapPoint(Message, frozen=True):
    """MapPoint."""

    ID: ClassVar[int] = 604
    WIRE: ClassVar[str] = "ddf"

    lat: float = 0.0  # rad, fp64
    lon: float = 0.0  # rad, fp64
    alt: float = 0.0  # m, fp32


class CcuEvent(Message, frozen=True):
    """CCU Event."""

    ID: ClassVar[int] = 606
    WIRE: ClassVar[str] = "BTM"

    class Type(IntEnum):
        LOG_ENTRY = 1
        PLAN_ADDED = 2
        PLAN_REMOVED = 3
        PLAN_CHANGED = 4
        MAP_FEATURE_ADDED = 5
        MAP_FEATURE_REMOVED = 6
        MAP_FEATURE_CHANGED = 7
        TELEOPERATION_STARTED = 8
        TELEOPERATION_ENDED = 9

    type: int = 0  # uint8, Type
    id: str = ""  # plaintext
    arg: Message | None = None  # message


class VehicleLinks(MessageWithLists, frozen=True):
    """Vehicle Links."""

    ID: ClassVar[int] = 650
    WIRE: ClassVar[str] = "TL"
    LISTS: ClassVar[tuple[str, ...]] = ("links",)

    localname: str = ""  # plaintext
    links: tuple[Message | None, ...] = ()  # message-list, Announce


class TrexObservation(Message, frozen=True):
    """TREX Observation."""

    ID: ClassVar[int] = 651
    WIRE: ClassVar[str] = "TTT"

    timeline: str = ""  # plaintext
    predicate: str = ""  # plaintext
    attributes: str = ""  # TupleList, plaintext


class TrexCommand(Message, frozen=True):
    """TREX Command."""

    ID: ClassVar[int] = 652
    WIRE: ClassVar[str] = "BTT"

    class Command(IntEnum):
        DISABLE = 0
        ENABLE = 1
        POST_GOAL = 2
        RECALL_GOAL = 3
        REQUEST_PLAN = 4
        REPORT_PLAN = 5

    command: int = 0  # uint8, Command
    goal_id: str = ""  # plaintext
    goal_xml: str = ""  # plaintext


class TrexOperation(Message, frozen=True):
    """TREX Operation."""

    ID: ClassVar[int] = 655
    WIRE: ClassVar[str] = "BTM"

    class Op(IntEnum):
        POST_TOKEN = 1
        POST_GOAL = 2
        RECALL_GOAL = 3
        REQUEST_PLAN = 4
        REPORT_PLAN = 5

    op: int = 0  # uint8, Op
    goal_id: str = ""  # plaintext
    token: Message | None = None  # message, TrexToken


class TrexAttribute(Message, frozen=True):
    """TREX Attribute."""

    ID: ClassVar[int] = 656
    WIRE: ClassVar[str] = "TBTT"

    class AttrType(IntEnum):
        BOOL = 1
        INT = 2
        FLOAT = 3
        STRING = 4
        ENUM = 5

    name: str = ""  # plaintext
    attr_type: int = 0  # uint8, AttrType
    min: str = ""  # plaintext
    max: str = ""  # plaintext


class TrexToken(MessageWithLists, frozen=True):
    """TREX Token."""

    ID: ClassVar[int] = 657
    WIRE: ClassVar[str] = "TTL"
    LISTS: ClassVar[tuple[str, ...]] = ("attributes",)

    timeline: str = ""  # plaintext
    predicate: str = ""  # plaintext
    attributes: tuple[Message | None, ...] = ()  # message-list, TrexAttribute


class TrexPlan(MessageWithLists, frozen=True):
    """TREX Plan."""

    ID: ClassVar[int] = 658
    WIRE: ClassVar[str] = "TL"
    LISTS: ClassVar[tuple[str, ...]] = ("tokens",)

    reactor: str = ""  # plaintext
    tokens: tuple[Message | None, ...] = ()  # message-list, TrexToken


class Event(Message, frozen=True):
    """Event."""

    ID: ClassVar[int] = 660
    WIRE: ClassVar[str] = "TT"

    topic: str = ""  # plaintext
    data: str = ""  # TupleList, plaintext


class CompressedImage(Message, frozen=True):
    """Compressed Image."""

    ID: ClassVar[int] = 702
    WIRE: ClassVar[str] = "BR"

    frameid: int = 0  # uint8
    data: bytes = b""  # rawdata


class ImageTxSettings(Message, frozen=True):
    """Image Transmission Settings."""

    ID: ClassVar[int] = 703
    WIRE: ClassVar[str] = "BBBB"

    fps: int = 0  # uint8
    quality: int = 0  # uint8
    reps: int = 0  # uint8
    tsize: int = 0  # uint8


class RemoteState(Message, frozen=True):
    """Remote State."""

    ID: ClassVar[int] = 750
    WIRE: ClassVar[str] = "ffBff"

    lat: float = 0.0  # rad, fp32, -1.5708 to 1.5708
    lon: float = 0.0  # rad, fp32, -3.14159 to 3.14159
    depth: int = 0  # m, uint8
    speed: float = 0.0  # m/s, fp32
    psi: float = 0.0  # rad, fp32


class Target(Message, frozen=True):
    """Target."""

    ID: ClassVar[int] = 800
    WIRE: ClassVar[str] = "TddfBff"

    label: str = ""  # plaintext
    lat: float = 0.0  # rad, fp64, -1.5708 to 1.5708
    lon: float = 0.0  # rad, fp64, -3.14159 to 3.14159
    z: float = 0.0  # m, fp32
    z_units: int = 0  # uint8, ZUnits
    cog: float = 0.0  # rad, fp32
    sog: float = 0.0  # m/s, fp32


class EntityParameter(Message, frozen=True):
    """EntityParameter."""

    ID: ClassVar[int] = 801
    WIRE: ClassVar[str] = "TT"

    name: str = ""  # plaintext
    value: str = ""  # plaintext


class EntityParameters(MessageWithLists, frozen=True):
    """EntityParameters."""

    ID: ClassVar[int] = 802
    WIRE: ClassVar[str] = "TL"
    LISTS: ClassVar[tuple[str, ...]] = ("params",)

    name: str = ""  # plaintext
    params: tuple[Message | None, ...] = ()  # message-list, EntityParameter


class QueryEntityParameters(Message, frozen=True):
    """QueryEntityParameters."""

    ID: ClassVar[int] = 803
    WIRE: ClassVar[str] = "TTT"

    name: str = ""  # plaintext
    visibility: str = ""  # plaintext
    scope: str = ""  # plaintext


class SetEntityParameters(MessageWithLists, frozen=True):
    """SetEntityParameters."""

    ID: ClassVar[int] = 804
    WIRE: ClassVar[str] = "TL"
    LISTS: ClassVar[tuple[str, ...]] = ("params",)

    name: str = ""  # plaintext
    params: tuple[Message | None, ...] = ()  # message-list, EntityParameter


class SaveEntityParameters(Message, frozen=True):
    """SaveEntityParameters."""

    ID: ClassVar[int] = 805
    WIRE: ClassVar[str] = "T"

    name: str = ""  # plaintext


class CreateSession(Message, frozen=True):
    """Create Session."""

    ID: ClassVar[int] = 806
    WIRE: ClassVar[str] = "I"

    timeout: int = 0  # uint32


class CloseSession(Message, frozen=True):
    """Close Session."""

    ID: ClassVar[int] = 807
    WIRE: ClassVar[str] = "I"

    sessid: int = 0  # uint32


class SessionSubscription(Message, frozen=True):
    """Session Subscription."""

    ID: ClassVar[int] = 808
    WIRE: ClassVar[str] = "IT"

    sessid: int = 0  # uint32
    messages: str = ""  # plaintext


class SessionKeepAlive(Message, frozen=True):
    """Session Keep-Alive."""

    ID: ClassVar[int] = 809
    WIRE: ClassVar[str] = "I"

    sessid: int = 0  # uint32


class SessionStatus(Message, frozen=True):
    """Session Status."""

    ID: ClassVar[int] = 810
    WIRE: ClassVar[str] = "IB"

    class Status(IntEnum):
        ESTABLISHED = 1
        CLOSED = 2

    sessid: int = 0  # uint32
    status: int = 0  # uint8, Status


class PushEntityParameters(Message, frozen=True):
    """Push Entity Parameters."""

    ID: ClassVar[int] = 811
    WIRE: ClassVar[str] = "T"

    name: str = ""  # plaintext


class PopEntityParameters(Message, frozen=True):
    """Pop Entity Parameters."""

    ID: ClassVar[int] = 812
    WIRE: ClassVar[str] = "T"

    name: str = ""  # plaintext


class IoEvent(Message, frozen=True):
    """I/O Event."""

    ID: ClassVar[int] = 813
    WIRE: ClassVar[str] = "BT"

    class Type(IntEnum):
        INPUT = 1
        INPUT_ERROR = 2

    type: int = 0  # uint8, Type
    error: str = ""  # plaintext


class UamTxFrame(Message, frozen=True):
    """UamTxFrame."""

    ID: ClassVar[int] = 814
    WIRE: ClassVar[str] = "HTBR"

    class Flags(IntFlag):
        ACK = 0x1
        DELAYED = 0x2
        FORCED = 0x4

    seq: int = 0  # uint16
    sys_dst: str = ""  # plaintext
    flags: int = 0  # uint8, Flags
    data: bytes = b""  # rawdata


class UamRxFrame(Message, frozen=True):
    """UamRxFrame."""

    ID: ClassVar[int] = 815
    WIRE: ClassVar[str] = "TTBR"

    class Flags(IntFlag):
        PROMISCUOUS = 0x1
        DELAYED = 0x2

    sys_src: str = ""  # plaintext
    sys_dst: str = ""  # plaintext
    flags: int = 0  # uint8, Flags
    data: bytes = b""  # rawdata


class UamTxStatus(Message, frozen=True):
    """UamTxStatus."""

    ID: ClassVar[int] = 816
    WIRE: ClassVar[str] = "HBT"

    class Value(IntEnum):
        DONE = 0
        FAILED = 1
        CANCELED = 2
        BUSY = 3
        INV_ADDR = 4
        IP = 5
        UNSUPPORTED = 6
        INV_SIZE = 7
        SENT = 8
        DELIVERED = 9
        NO_TRANSDUCER = 10

    seq: int = 0  # uint16
    value: int = 0  # uint8, Value
    error: str = ""  # plaintext


class UamRxRange(Message, frozen=True):
    """UamRxRange."""

    ID: ClassVar[int] = 817
    WIRE: ClassVar[str] = "HTf"

    seq: int = 0  # uint16
    sys: str = ""  # plaintext
    value: float = 0.0  # m, fp32


class UamTxRange(Message, frozen=True):
    """UamTxRange."""

    ID: ClassVar[int] = 818
    WIRE: ClassVar[str] = "HTf"

    seq: int = 0  # uint16
    sys_dst: str = ""  # plaintext
    timeout: float = 0.0  # s, fp32


class FormCtrlParam(Message, frozen=True):
    """Formation Control Parameters."""

    ID: ClassVar[int] = 820
    WIRE: ClassVar[str] = "BffIff"

    class Action(IntEnum):
        REQ = 0
        SET = 1
        REP = 2

    action: int = 0  # uint8, Action
    longain: float = 0.0  # fp32
    latgain: float = 0.0  # fp32
    bondthick: int = 0  # uint32
    leadgain: float = 0.0  # fp32
    deconflgain: float = 0.0  # fp32


class FormationEval(Message, frozen=True):
    """Formation Evaluation Data."""

    ID: ClassVar[int] = 821
    WIRE: ClassVar[str] = "fff"

    err_mean: float = 0.0  # fp32
    dist_min_abs: float = 0.0  # fp32
    dist_min_mean: float = 0.0  # fp32


class FormationControlParams(Message, frozen=True):
    """Formation Control Parameters."""

    ID: ClassVar[int] = 822
    WIRE: ClassVar[str] = "Bffffffffff"

    class Action(IntEnum):
        REQ = 0
        SET = 1
        REP = 2

    action: int = 0  # uint8, Action
    lon_gain: float = 0.0  # fp32
    lat_gain: float = 0.0  # fp32
    bond_thick: float = 0.0  # fp32
    lead_gain: float = 0.0  # fp32
    deconfl_gain: float = 0.0  # fp32
    accel_switch_gain: float = 0.0  # fp32
    safe_dist: float = 0.0  # fp32
    deconflict_offset: float = 0.0  # fp32
    accel_safe_margin: float = 0.0  # fp32
    accel_lim_x: float = 0.0  # fp32


class FormationEvaluation(Message, frozen=True):
    """Formation Evaluation Data."""

    ID: ClassVar[int] = 823
    WIRE: ClassVar[str] = "BBfffffM"

    class Type(IntEnum):
        REQUEST = 0
        REPORT = 1

    class Op(IntEnum):
        START = 0
        STOP = 1
        READY = 2
        EXECUTING = 3
        FAILURE = 4

    type: int = 0  # uint8, Type
    op: int = 0  # uint8, Op
    err_mean: float = 0.0  # fp32
    dist_min_abs: float = 0.0  # fp32
    dist_min_mean: float = 0.0  # fp32
    roll_rate_mean: float = 0.0  # fp32
    time: float = 0.0  # fp32
    controlparams: Message | None = None  # message, FormationControlParams


class SoiWaypoint(Message, frozen=True):
    """SOI Waypoint."""

    ID: ClassVar[int] = 850
    WIRE: ClassVar[str] = "ffIH"

    lat: float = 0.0  # °, fp32
    lon: float = 0.0  # °, fp32
    eta: int = 0  # uint32
    duration: int = 0  # s, uint16


class SoiPlan(MessageWithLists, frozen=True):
    """SOI Plan."""

    ID: ClassVar[int] = 851
    WIRE: ClassVar[str] = "HL"
    LISTS: ClassVar[tuple[str, ...]] = ("waypoints",)

    plan_id: int = 0  # uint16
    waypoints: tuple[Message | None, ...] = ()  # message-list, SoiWaypoint


class SoiCommand(Message, frozen=True):
    """SOI Command."""

    ID: ClassVar[int] = 852
    WIRE: ClassVar[str] = "BBTMT"

    class Type(IntEnum):
        REQUEST = 1
        SUCCESS = 2
        ERROR = 3

    class Command(IntEnum):
        EXEC = 1
        STOP = 2
        SET_PARAMS = 3
        GET_PARAMS = 4
        GET_PLAN = 5
        RESUME = 6

    type: int = 0  # uint8, Type
    command: int = 0  # uint8, Command
    settings: str = ""  # TupleList, plaintext
    plan: Message | None = None  # message, SoiPlan
    info: str = ""  # plaintext


class SoiState(Message, frozen=True):
    """SOI State."""

    ID: ClassVar[int] = 853
    WIRE: ClassVar[str] = "BHBH"

    class State(IntEnum):
        EXEC = 1
        IDLE = 2
        INACTIVE = 3

    state: int = 0  # uint8, State
    plan_id: int = 0  # uint16
    wpt_id: int = 0  # uint8
    settings_chk: int = 0  # uint16


class MessagePart(Message, frozen=True):
    """Message Fragment."""

    ID: ClassVar[int] = 877
    WIRE: ClassVar[str] = "BBBR"

    uid: int = 0  # uint8
    frag_number: int = 0  # uint8
    num_frags: int = 0  # uint8
    data: bytes = b""  # rawdata


class MessagePartControl(Message, frozen=True):
    """Message Fragment Control."""

    ID: ClassVar[int] = 878
    WIRE: ClassVar[str] = "BBT"

    class Op(IntEnum):
        STATUS_RECEIVED = 0
        REQUEST_RETRANSMIT = 1

    uid: int = 0  # uint8
    op: int = 0  # uint8, Op
    frag_ids: str = ""  # plaintext


class NeptusBlob(Message, frozen=True):
    """Neptus Blob."""

    ID: ClassVar[int] = 888
    WIRE: ClassVar[str] = "TR"

    content_type: str = ""  # plaintext
    content: bytes = b""  # rawdata


class Aborted(Message, frozen=True):
    """Aborted."""

    ID: ClassVar[int] = 889


class UsblAngles(Message, frozen=True):
    """USBL Angles."""

    ID: ClassVar[int] = 890
    WIRE: ClassVar[str] = "Hff"

    target: int = 0  # uint16
    bearing: float = 0.0  # rad, fp32
    elevation: float = 0.0  # rad, fp32


class UsblPosition(Message, frozen=True):
    """USBL Position."""

    ID: ClassVar[int] = 891
    WIRE: ClassVar[str] = "Hfff"

    target: int = 0  # uint16
    x: float = 0.0  # m, fp32
    y: float = 0.0  # m, fp32
    z: float = 0.0  # m, fp32


class UsblFix(Message, frozen=True):
    """USBL Fix."""

    ID: ClassVar[int] = 892
    WIRE: ClassVar[str] = "HddBf"

    target: int = 0  # uint16
    lat: float = 0.0  # rad, fp64, -1.5708 to 1.5708
    lon: float = 0.0  # rad, fp64, -3.14159 to 3.14159
    z_units: int = 0  # uint8, ZUnits
    z: float = 0.0  # m, fp32


class ParametersXml(Message, frozen=True):
    """Parameters XML."""

    ID: ClassVar[int] = 893
    WIRE: ClassVar[str] = "TR"

    locale: str = ""  # plaintext
    config: bytes = b""  # rawdata


class GetParametersXml(Message, frozen=True):
    """Get Parameters XML."""

    ID: ClassVar[int] = 894


class SetImageCoords(Message, frozen=True):
    """Set Image Coordinates."""

    ID: ClassVar[int] = 895
    WIRE: ClassVar[str] = "BHH"

    camid: int = 0  # uint8
    x: int = 0  # px, uint16
    y: int = 0  # px, uint16


class GetImageCoords(Message, frozen=True):
    """Get Image Coordinates."""

    ID: ClassVar[int] = 896
    WIRE: ClassVar[str] = "BHH"

    camid: int = 0  # uint8
    x: int = 0  # px, uint16
    y: int = 0  # px, uint16


class GetWorldCoordinates(Message, frozen=True):
    """Get World Coordinates."""

    ID: ClassVar[int] = 897
    WIRE: ClassVar[str] = "Bddfff"

    tracking: int = 0  # uint8, Boolean
    lat: float = 0.0  # rad, fp64
    lon: float = 0.0  # rad, fp64
    x: float = 0.0  # m, fp32
    y: float = 0.0  # m, fp32
    z: float = 0.0  # m, fp32


class UsblAnglesExtended(Message, frozen=True):
    """USBL Angles Extended."""

    ID: ClassVar[int] = 898
    WIRE: ClassVar[str] = "Tffffffff"

    target: str = ""  # plaintext
    lbearing: float = 0.0  # rad, fp32
    lelevation: float = 0.0  # rad, fp32
    bearing: float = 0.0  # rad, fp32
    elevation: float = 0.0  # rad, fp32
    phi: float = 0.0  # rad, fp32, -3.14159 to 3.14159
    theta: float = 0.0  # rad, fp32, -1.5708 to 1.5708
    psi: float = 0.0  # rad, fp32, -3.14159 to 3.14159
    accuracy: float = 0.0  # rad, fp32, 0 to 3.14159


class UsblPositionExtended(Message, frozen=True):
    """USBL Position Extended."""

    ID: ClassVar[int] = 899
    WIRE: ClassVar[str] = "Tffffffffff"

    target: str = ""  # plaintext
    x: float = 0.0  # m, fp32
    y: float = 0.0  # m, fp32
    z: float = 0.0  # m, fp32
    n: float = 0.0  # m, fp32
    e: float = 0.0  # m, fp32
    d: float = 0.0  # m, fp32
    phi: float = 0.0  # rad, fp32, -3.14159 to 3.14159
    theta: float = 0.0  # rad, fp32, -1.5708 to 1.5708
    psi: float = 0.0  # rad, fp32, -3.14159 to 3.14159
    accuracy: float = 0.0  # m, fp32, at least 0


class UsblFixExtended(Message, frozen=True):
    """USBL Fix Extended."""

    ID: ClassVar[int] = 900
    WIRE: ClassVar[str] = "TddBff"

    target: str = ""  # plaintext
    lat: float = 0.0  # rad, fp64, -1.5708 to 1.5708
    lon: float = 0.0  # rad, fp64, -3.14159 to 3.14159
    z_units: int = 0  # uint8, ZUnits
    z: float = 0.0  # m, fp32
    accuracy: float = 0.0  # m, fp32, at least 0


class UsblModem(Message, frozen=True):
    """USBL Modem Configuration."""

    ID: ClassVar[int] = 901
    WIRE: ClassVar[str] = "TddfB"

    name: str = ""  # plaintext
    lat: float = 0.0  # rad, fp64, -1.5708 to 1.5708
    lon: float = 0.0  # rad, fp64, -3.14159 to 3.14159
    z: float = 0.0  # m, fp32
    z_units: int = 0  # uint8, ZUnits


class UsblConfig(MessageWithLists, frozen=True):
    """USBL Configuration."""

    ID: ClassVar[int] = 902
    WIRE: ClassVar[str] = "BL"
    LISTS: ClassVar[tuple[str, ...]] = ("modems",)

    class Op(IntEnum):
        SET_CFG = 0
        GET_CFG = 1
        CUR_CFG = 2

    op: int = 0  # uint8, Op
    modems: tuple[Message | None, ...] = ()  # message-list, UsblModem


class DissolvedOrganicMatter(Message, frozen=True):
    """Dissolved Organic Matter."""

    ID: ClassVar[int] = 903
    WIRE: ClassVar[str] = "fB"

    class Type(IntEnum):
        COLORED = 0
        FLUORESCENT = 1

    value: float = 0.0  # PPB, fp32
    type: int = 0  # uint8, Type


class OpticalBackscatter(Message, frozen=True):
    """Optical Backscattering Coefficient."""

    ID: ClassVar[int] = 904
    WIRE: ClassVar[str] = "f"

    value: float = 0.0  # 1/m, fp32


class Tachograph(Message, frozen=True):
    """Tachograph."""

    ID: ClassVar[int] = 905
    WIRE: ClassVar[str] = "dffffffffffffhhf"

    timestamp_last_service: float = 0.0  # s, fp64
    time_next_service: float = 0.0  # s, fp32
    time_motor_next_service: float = 0.0  # s, fp32
    time_idle_ground: float = 0.0  # s, fp32
    time_idle_air: float = 0.0  # s, fp32
    time_idle_water: float = 0.0  # s, fp32
    time_idle_underwater: float = 0.0  # s, fp32
    time_idle_unknown: float = 0.0  # s, fp32
    time_motor_ground: float = 0.0  # s, fp32
    time_motor_air: float = 0.0  # s, fp32
    time_motor_water: float = 0.0  # s, fp32
    time_motor_underwater: float = 0.0  # s, fp32
    time_motor_unknown: float = 0.0  # s, fp32
    rpm_min: int = 0  # rpm, int16
    rpm_max: int = 0  # rpm, int16
    depth_max: float = 0.0  # m, fp32


class ApmStatus(Message, frozen=True):
    """APM Status."""

    ID: ClassVar[int] = 906
    WIRE: ClassVar[str] = "BT"

    class Severity(IntEnum):
        EMERGENCY = 0
        ALERT = 1
        CRITICAL = 2
        ERROR = 3
        WARNING = 4
        NOTICE = 5
        INFO = 6
        DEBUG = 7

    severity: int = 0  # uint8, Severity
    text: str = ""  # plaintext


class SadcReadings(Message, frozen=True):
    """SADC Readings."""

    ID: ClassVar[int] = 907
    WIRE: ClassVar[str] = "biB"

    class Gain(IntEnum):
        X1 = 0
        X10 = 1
        X100 = 2

    channel: int = 0  # int8, 1 to 4
    value: int = 0  # int32
    gain: int = 0  # uint8, Gain


class DmsDetection(Message, frozen=True):
    """DMS Detection."""

    ID: ClassVar[int] = 908
    WIRE: ClassVar[str] = "ffffffffffffffff"

    ch01: float = 0.0  # fp32
    ch02: float = 0.0  # fp32
    ch03: float = 0.0  # fp32
    ch04: float = 0.0  # fp32
    ch05: float = 0.0  # fp32
    ch06: float = 0.0  # fp32
    ch07: float = 0.0  # fp32
    ch08: float = 0.0  # fp32
    ch09: float = 0.0  # fp32
    ch10: float = 0.0  # fp32
    ch11: float = 0.0  # fp32
    ch12: float = 0.0  # fp32
    ch13: float = 0.0  # fp32
    ch14: float = 0.0  # fp32
    ch15: float = 0.0  # fp32
    ch16: float = 0.0  # fp32


class HomePosition(Message, frozen=True):
    """Home Position."""

    ID: ClassVar[int] = 909
    WIRE: ClassVar[str] = "Bddfff"

    class Op(IntEnum):
        SET = 1
        REPORT = 2

    op: int = 0  # uint8, Op
    lat: float = 0.0  # rad, fp64, -1.5708 to 1.5708
    lon: float = 0.0  # rad, fp64, -3.14159 to 3.14159
    height: float = 0.0  # m, fp32
    depth: float = 0.0  # m, fp32
    alt: float = 0.0  # m, fp32


class AbsoluteWind(Message, frozen=True):
    """Absolute Wind."""

    ID: ClassVar[int] = 911
    WIRE: ClassVar[str] = "fff"

    direction: float = 0.0  # rad, fp32
    speed: float = 0.0  # m/s, fp32
    turbulence: float = 0.0  # m/s, fp32


class AisInfo(Message, frozen=True):
    """AIS Info."""

    ID: ClassVar[int] = 912
    WIRE: ClassVar[str] = "TTTTTBBddffffffff"

    msg_type: str = ""  # plaintext
    sensor_class: str = ""  # plaintext
    mmsi: str = ""  # plaintext
    callsign: str = ""  # plaintext
    name: str = ""  # plaintext
    nav_status: int = 0  # uint8
    type_and_cargo: int = 0  # uint8
    lat: float = 0.0  # rad, fp64
    lon: float = 0.0  # rad, fp64
    course: float = 0.0  # °, fp32
    speed: float = 0.0  # kn, fp32
    dist: float = 0.0  # m, fp32
    a: float = 0.0  # m, fp32
    b: float = 0.0  # m, fp32
    c: float = 0.0  # m, fp32
    d: float = 0.0  # m, fp32
    draught: float = 0.0  # m, fp32


class ENCAwareness(Message, frozen=True):
    """ENC Awareness."""

    ID: ClassVar[int] = 913
    WIRE: ClassVar[str] = "TT"

    depth_at_loc: str = ""  # plaintext
    danger: str = ""  # plaintext


class Displacement(Message, frozen=True):
    """Position Displacement."""

    ID: ClassVar[int] = 915
    WIRE: ClassVar[str] = "dddd"

    time: float = 0.0  # s, fp64
    x: float = 0.0  # m, fp64
    y: float = 0.0  # m, fp64
    z: float = 0.0  # m, fp64


class CurrentProfile(MessageWithLists, frozen=True):
    """Current Profile."""

    ID: ClassVar[int] = 1014
    WIRE: ClassVar[str] = "BBBL"
    LISTS: ClassVar[tuple[str, ...]] = ("profile",)

    class CoordSys(IntFlag):
        XYZ = 0x1
        NED = 0x2
        BEAMS = 0x4
        ENU = 0x8

    nbeams: int = 0  # uint8
    ncells: int = 0  # uint8
    coord_sys: int = 0  # uint8, CoordSys
    profile: tuple[Message | None, ...] = ()  # message-list, CurrentProfileCell


class CurrentProfileCell(MessageWithLists, frozen=True):
    """Current Profile Cell."""

    ID: ClassVar[int] = 1015
    WIRE: ClassVar[str] = "fL"
    LISTS: ClassVar[tuple[str, ...]] = ("beams",)

    cell_position: float = 0.0  # m, fp32
    beams: tuple[Message | None, ...] = ()  # message-list, ADCPBeam


class ADCPBeam(Message, frozen=True):
    """ADCP Beam Measurements."""

    ID: ClassVar[int] = 1016
    WIRE: ClassVar[str] = "ffB"

    vel: float = 0.0  # m/s, fp32
    amp: float = 0.0  # dB, fp32
    cor: int = 0  # %, uint8, 0 to 100


class Frequency(Message, frozen=True):
    """Frequency."""

    ID: ClassVar[int] = 1017
    WIRE: ClassVar[str] = "f"

    value: float = 0.0  # Hz, fp32


class WaveSpectrumParameters(Message, frozen=True):
    """Wave Spectrum Parameters."""

    ID: ClassVar[int] = 1018
    WIRE: ClassVar[str] = "fffffffffffffffffffffffffff"

    sig_wave_height_hm0: float = 0.0  # m, fp32
    wave_peak_direction: float = 0.0  # °, fp32
    wave_peak_period: float = 0.0  # s, fp32
    wave_height_wind_hm0: float = 0.0  # m, fp32
    wave_height_swell_hm0: float = 0.0  # m, fp32
    wave_peak_period_wind: float = 0.0  # s, fp32
    wave_peak_period_swell: float = 0.0  # s, fp32
    wave_peak_direction_wind: float = 0.0  # °, fp32
    wave_peak_direction_swell: float = 0.0  # °, fp32
    wave_mean_direction: float = 0.0  # °, fp32
    wave_mean_period_tm02: float = 0.0  # s, fp32
    wave_height_hmax: float = 0.0  # m, fp32
    wave_height_crest: float = 0.0  # m, fp32
    wave_height_trough: float = 0.0  # m, fp32
    wave_period_tmax: float = 0.0  # s, fp32
    wave_period_tz: float = 0.0  # s, fp32
    significant_wave_height_h1_3: float = 0.0  # m, fp32
    mean_spreading_angle: float = 0.0  # °, fp32
    first_order_spread: float = 0.0  # °, fp32
    long_crestedness_parameters: float = 0.0  # fp32
    heading: float = 0.0  # °, fp32
    pitch: float = 0.0  # °, fp32
    roll: float = 0.0  # °, fp32
    external_heading: float = 0.0  # °, fp32
    stdev_heading: float = 0.0  # °, fp32
    stdev_pitch: float = 0.0  # °, fp32
    stdev_roll: float = 0.0  # °, fp32


class GpioState(Message, frozen=True):
    """GPIO State."""

    ID: ClassVar[int] = 2000
    WIRE: ClassVar[str] = "TB"

    name: str = ""  # plaintext
    value: int = 0  # uint8


class EstimatedMugState(Message, frozen=True):
    """Estimated Mug State."""

    ID: ClassVar[int] = 2001
    WIRE: ClassVar[str] = "iff"

    id: int = 0  # int32
    x: float = 0.0  # m, fp32
    y: float = 0.0  # m, fp32


class GpioStateSet(Message, frozen=True):
    """Set GPIO State."""

    ID: ClassVar[int] = 2002
    WIRE: ClassVar[str] = "TB"

    name: str = ""  # plaintext
    value: int = 0  # uint8


class ColoredDissolvedOrganicMatter(Message, frozen=True):
    """Colored Dissolved Organic Matter."""

    ID: ClassVar[int] = 2003
    WIRE: ClassVar[str] = "f"

    value: float = 0.0  # PPB, fp32


class FluorescentDissolvedOrganicMatter(Message, frozen=True):
    """Fluorescent Dissolved Organic Matter."""

    ID: ClassVar[int] = 2004
    WIRE: ClassVar[str] = "f"

    value: float = 0.0  # PPB, fp32


class TotalMagIntensity(Message, frozen=True):
    """Total Magnetic Field Intensity."""

    ID: ClassVar[int] = 2006
    WIRE: ClassVar[str] = "d"

    value: float = 0.0  # fp64


class CommRestriction(Message, frozen=True):
    """Communication Restriction."""

    ID: ClassVar[int] = 2010
    WIRE: ClassVar[str] = "BT"

    class Restriction(IntFlag):
        SATELLITE = 0x1
        ACOUSTIC = 0x2
        WIFI = 0x4
        GSM = 0x8

    restriction: int = 0  # uint8, Restriction
    reason: str = ""  # plaintext


class QueryTypedEntityParameters(MessageWithLists, frozen=True):
    """Query Typed Entity Parameters."""

    ID: ClassVar[int] = 2016
    WIRE: ClassVar[str] = "BITL"
    LISTS: ClassVar[tuple[str, ...]] = ("parameters",)

    class Op(IntEnum):
        REQUEST = 0
        REPLY = 1

    op: int = 0  # uint8, Op
    request_id: int = 0  # uint32
    entity_name: str = ""  # plaintext
    parameters: tuple[Message | None, ...] = ()  # message-list, TypedEntityParametersOptions


class TypedEntityParameter(MessageWithLists, frozen=True):
    """Typed Entity Parameter."""

    ID: ClassVar[int] = 2017
    WIRE: ClassVar[str] = "TBTTTTffBBLBB"
    LISTS: ClassVar[tuple[str, ...]] = ("values_if_list",)

    class Type(IntEnum):
        BOOL = 1
        INT = 2
        FLOAT = 3
        STRING = 4
        LIST_BOOL = 5
        LIST_INT = 6
        LIST_FLOAT = 7
        LIST_STRING = 8

    class Visibility(IntEnum):
        USER = 0
        DEVELOPER = 1
        USER_NOT_EDITABLE = 2
        DEVELOPER_NOT_EDITABLE = 3

    class Scope(IntEnum):
        GLOBAL = 0
        IDLE = 1
        PLAN = 2
        MANEUVER = 3

    name: str = ""  # plaintext
    type: int = 0  # uint8, Type
    default_value: str = ""  # plaintext
    units: str = ""  # plaintext
    description: str = ""  # plaintext
    values_list: str = ""  # plaintext
    min_value: float = 0.0  # fp32
    max_value: float = 0.0  # fp32
    list_min_size: int = 0  # uint8
    list_max_size: int = 0  # uint8
    values_if_list: tuple[Message | None, ...] = ()  # message-list, ValuesIf
    visibility: int = 0  # uint8, Visibility
    scope: int = 0  # uint8, Scope


class ValuesIf(Message, frozen=True):
    """Values If."""

    ID: ClassVar[int] = 2018
    WIRE: ClassVar[str] = "TTT"

    param: str = ""  # plaintext
    value: str = ""  # plaintext
    values_list: str = ""  # plaintext


class VersionInfo(Message, frozen=True):
    """Version Info."""

    ID: ClassVar[int] = 2021
    WIRE: ClassVar[str] = "BTT"

    class Op(IntEnum):
        REPLY = 0
        QUERY = 1

    op: int = 0  # uint8, Op
    version: str = ""  # plaintext
    description: str = ""  # plaintext


class TotalHeading(Message, frozen=True):
    """Total Heading."""

    ID: ClassVar[int] = 2022
    WIRE: ClassVar[str] = "f"

    value: float = 0.0  # rad, fp32


class BDI(Message, frozen=True):
    """Battery Detailed Info."""

    ID: ClassVar[int] = 2035
    WIRE: ClassVar[str] = "h"

    soh: int = 0  # %, int16


class TypedEntityParameterEditor(Message, frozen=True):
    """Typed Entity Parameter Editor."""

    ID: ClassVar[int] = 2036
    WIRE: ClassVar[str] = "T"

    value: str = ""  # plaintext


class QueryBmsData(Message, frozen=True):
    """Query BMS Data."""

    ID: ClassVar[int] = 2041
    WIRE: ClassVar[str] = "BBBR"

    class Op(IntEnum):
        READ_TELEMETRY = 0
        READ_CELL_VOLTAGES = 1
        READ_STATUS = 2
        READ_ALL = 3
        READ_RAW = 4
        WRITE_RAW = 5
        SET_FET = 6

    op: int = 0  # uint8, Op
    pack_idx: int = 0  # uint8
    sbs_register: int = 0  # uint8
    data: bytes = b""  # rawdata


class BmsData(MessageWithLists, frozen=True):
    """BMS Data."""

    ID: ClassVar[int] = 2042
    WIRE: ClassVar[str] = "MBBfffBBBHHHHHHHHIIIHHLLR"
    LISTS: ClassVar[tuple[str, ...]] = ("cell_voltages", "registers")

    class ReqStatus(IntEnum):
        SUCCESS = 0
        FAILURE = 1
        NOT_SUPPORTED = 2
        INVALID_PACK = 3

    class BatteryStatus(IntFlag):
        OCA = 0x8000
        TCA = 0x4000
        OTA = 0x1000
        TDA = 0x0800
        RCA = 0x0200
        RTA = 0x0100
        INIT = 0x0080
        DSG = 0x0040
        FC = 0x0020
        FD = 0x0010
        EC = 0x0007

    class FetStatus(IntFlag):
        CHG = 0x1
        DSG = 0x2
        PCHG = 0x4

    class SafetyStatus(IntFlag):
        OC = 0x100000
        CTO = 0x040000
        PTO = 0x010000
        OCDL = 0x004000
        OTF = 0x002000
        AFE_OVRD = 0x001000
        UTD = 0x000800
        UTC = 0x000400
        OTD = 0x000200
        OTC = 0x000100
        ASCDL = 0x000080
        ASCD = 0x000040
        AOLDL = 0x000020
        AOLD = 0x000010
        OCD = 0x000008
        OCC = 0x000004
        COV = 0x000002
        CUV = 0x000001

    class PfStatus(IntFlag):
        DFW = 0x20000
        IFC = 0x10000
        SOTF = 0x08000
        TS3 = 0x04000
        TS2 = 0x02000
        TS1 = 0x01000
        AFE_XRDY = 0x00800
        AFE_OVRD = 0x00400
        AFEC = 0x00200
        AFER = 0x00100
        DFETF = 0x00080
        CFETF = 0x00040
        VIMR = 0x00020
        SOT = 0x00010
        SOCD = 0x00008
        SOCC = 0x00004
        SOV = 0x00002
        SUV = 0x00001

    class OperationStatus(IntFlag):
        KEYIN = 0x80000000
        CB = 0x10000000
        SLPCC = 0x08000000
        SLPAD = 0x04000000
        INIT = 0x01000000
        SLEEPM = 0x00800000
        XL = 0x00400000
        CAL_OFFSET = 0x00200000
        CAL = 0x00100000
        AUTH = 0x00040000
        LED = 0x00020000
        SDM = 0x00010000
        SLEEP = 0x00008000
        XCHG = 0x00004000
        XDSG = 0x00002000
        PF = 0x00001000
        SAFE_MODE = 0x00000800
        SDV = 0x00000400
        SEC1 = 0x00000200
        SEC0 = 0x00000100
        SAFE = 0x00000020
        HCFET = 0x00000010
        PCHG = 0x00000008
        DSG = 0x00000004
        CHG = 0x00000002
        PRES = 0x00000001

    class ChargingStatus(IntFlag):
        VCT = 0x8000
        SU = 0x2000
        IN = 0x1000
        FCHG = 0x0200
        PCHG = 0x0100
        OT = 0x0010
        HT = 0x0008
        ST = 0x0004
        LT = 0x0002
        UT = 0x0001

    class GaugingStatus(IntFlag):
        VDQ = 0x8000
        EDV2 = 0x4000
        EDV1 = 0x2000
        FCCX = 0x0400
        REST = 0x0100
        CF = 0x0080
        DSG = 0x0040
        EDV0 = 0x0020
        BAL_OK = 0x0010
        TC = 0x0008
        TD = 0x0004
        FC = 0x0002
        FD = 0x0001

    original: Message | None = None  # message
    req_status: int = 0  # uint8, ReqStatus
    pack_idx: int = 0  # uint8
    temperature: float = 0.0  # °C, fp32
    voltage: float = 0.0  # V, fp32
    current: float = 0.0  # A, fp32
    rsoc: int = 0  # %, uint8
    asoc: int = 0  # %, uint8
    soh: int = 0  # %, uint8
    remaining_capacity: int = 0  # mAh, uint16
    full_charge_capacity: int = 0  # mAh, uint16
    cycle_count: int = 0  # uint16
    time_to_empty: int = 0  # min, uint16
    time_to_full: int = 0  # min, uint16
    battery_status: int = 0  # uint16, BatteryStatus
    serial_number: int = 0  # uint16
    fet_status: int = 0  # uint16, FetStatus
    safety_status: int = 0  # uint32, SafetyStatus
    pf_status: int = 0  # uint32, PfStatus
    operation_status: int = 0  # uint32, OperationStatus
    charging_status: int = 0  # uint16, ChargingStatus
    gauging_status: int = 0  # uint16, GaugingStatus
    cell_voltages: tuple[Message | None, ...] = ()  # message-list, BmsCellVoltage
    registers: tuple[Message | None, ...] = ()  # message-list, BmsRegister
    data: bytes = b""  # rawdata


class BmsCellVoltage(Message, frozen=True):
    """BMS Cell Voltage."""

    ID: ClassVar[int] = 2043
    WIRE: ClassVar[str] = "Bf"

    cell_number: int = 0  # uint8
    voltage: float = 0.0  # V, fp32


class BmsRegister(Message, frozen=True):
    """BMS Register."""

    ID: ClassVar[int] = 2044
    WIRE: ClassVar[str] = "BR"

    reg: int = 0  # uint8
    value: bytes = b""  # rawdata


class CameraFrame(Message, frozen=True):
    """Camera Frame."""

    ID: ClassVar[int] = 2900
    WIRE: ClassVar[str] = "IdHHffffBffffffffffffffT"

    class Pose(IntEnum):
        ESTIMATE = 0
        TRUTH = 1

    index: int = 0  # uint32
    time: float = 0.0  # s, fp64
    width: int = 0  # px, uint16
    height: int = 0  # px, uint16
    fx: float = 0.0  # px, fp32
    fy: float = 0.0  # px, fp32
    cx: float = 0.0  # px, fp32
    cy: float = 0.0  # px, fp32
    pose: int = 0  # uint8, Pose
    x: float = 0.0  # m, fp32
    y: float = 0.0  # m, fp32
    z: float = 0.0  # m, fp32
    qw: float = 0.0  # fp32
    qx: float = 0.0  # fp32
    qy: float = 0.0  # fp32
    qz: float = 0.0  # fp32
    est_x: float = 0.0  # m, fp32
    est_y: float = 0.0  # m, fp32
    est_z: float = 0.0  # m, fp32
    est_qw: float = 0.0  # fp32
    est_qx: float = 0.0  # fp32
    est_qy: float = 0.0  # fp32
    est_qz: float = 0.0  # fp32
    file: str = ""  # plaintext


BY_ID: dict[int, type[Message]] = {
    1: EntityState,
    2: QueryEntityState,
    3: EntityInfo,
    4: QueryEntityInfo,
    5: EntityList,
    7: CpuUsage,
    8: TransportBindings,
    9: RestartSystem,
    12: DevCalibrationControl,
    13: DevCalibrationState,
    14: EntityActivationState,
    15: QueryEntityActivationState,
    16: VehicleOperationalLimits,
    20: MsgList,
    21: RamUsage,
    50: SimulatedState,
    51: LeakSimulation,
    52: UASimulation,
    53: DynamicsSimParam,
    100: StorageUsage,
    101: CacheControl,
    102: LoggingControl,
    103: LogBookEntry,
    104: LogBookControl,
    105: ReplayControl,
    106: ClockControl,
    107: HistoricCTD,
    108: HistoricTelemetry,
    109: HistoricSonarData,
    110: HistoricEvent,
    111: VerticalProfile,
    112: ProfileSample,
    150: Heartbeat,
    151: Announce,
    152: AnnounceService,
    153: RSSI,
    154: VSWR,
    155: LinkLevel,
    156: Sms,
    157: SmsTx,
    158: SmsRx,
    159: SmsState,
    160: TextMessage,
    170: IridiumMsgRx,
    171: IridiumMsgTx,
    172: IridiumTxStatus,
    180: GroupMembershipState,
    181: SystemGroup,
    182: LinkLatency,
    183: ExtendedRSSI,
    184: HistoricData,
    185: CompressedHistory,
    186: HistoricSample,
    187: HistoricDataQuery,
    188: RemoteCommand,
    189: CommSystemsQuery,
    190: TelemetryMsg,
    200: LblRange,
    202: LblBeacon,
    203: LblConfig,
    206: AcousticMessage,
    207: SimAcousticMessage,
    211: AcousticOperation,
    212: AcousticSystemsQuery,
    213: AcousticSystems,
    214: AcousticLink,
    215: AcousticRequest,
    216: AcousticStatus,
    217: AcousticRelease,
    250: Rpm,
    251: Voltage,
    252: Current,
    253: GpsFix,
    254: EulerAngles,
    255: EulerAnglesDelta,
    256: AngularVelocity,
    257: Acceleration,
    258: MagneticField,
    259: GroundVelocity,
    260: WaterVelocity,
    261: VelocityDelta,
    262: Distance,
    263: Temperature,
    264: Pressure,
    265: Depth,
    266: DepthOffset,
    267: SoundSpeed,
    268: WaterDensity,
    269: Conductivity,
    270: Salinity,
    271: WindSpeed,
    272: RelativeHumidity,
    273: DevDataText,
    274: DevDataBinary,
    275: Force,
    276: SonarData,
    277: Pulse,
    278: PulseDetectionControl,
    279: FuelLevel,
    280: GpsNavData,
    281: ServoPosition,
    282: DeviceState,
    283: BeamConfig,
    284: DataSanity,
    285: RhodamineDye,
    286: CrudeOil,
    287: FineOil,
    288: Turbidity,
    289: Chlorophyll,
    290: Fluorescein,
    291: Phycocyanin,
    292: Phycoerythrin,
    293: GpsFixRtk,
    294: ExternalNavData,
    295: DissolvedOxygen,
    296: AirSaturation,
    297: Throttle,
    298: PH,
    299: Redox,
    300: CameraZoom,
    301: SetThrusterActuation,
    302: SetServoPosition,
    303: SetControlSurfaceDeflection,
    304: RemoteActionsRequest,
    305: RemoteActions,
    306: ButtonEvent,
    307: LcdControl,
    308: PowerOperation,
    309: PowerChannelControl,
    310: QueryPowerChannelState,
    311: PowerChannelState,
    312: LedBrightness,
    313: QueryLedBrightness,
    314: SetLedBrightness,
    315: SetPWM,
    316: PWM,
    350: EstimatedState,
    351: EstimatedStreamVelocity,
    352: IndicatedSpeed,
    353: TrueSpeed,
    354: NavigationUncertainty,
    355: NavigationData,
    356: GpsFixRejection,
    357: LblRangeAcceptance,
    358: DvlRejection,
    360: LblEstimate,
    361: AlignmentState,
    362: GroupStreamVelocity,
    363: Airflow,
    364: Power,
    400: DesiredHeading,
    401: DesiredZ,
    402: DesiredSpeed,
    403: DesiredRoll,
    404: DesiredPitch,
    405: DesiredVerticalRate,
    406: DesiredPath,
    407: DesiredControl,
    408: DesiredHeadingRate,
    409: DesiredVelocity,
    410: PathControlState,
    411: AllocatedControlTorques,
    412: ControlParcel,
    413: Brake,
    414: DesiredLinearState,
    415: DesiredThrottle,
    450: Goto,
    451: PopUp,
    452: Teleoperation,
    453: Loiter,
    454: IdleManeuver,
    455: LowLevelControl,
    456: Rows,
    457: FollowPath,
    458: PathPoint,
    459: YoYo,
    460: TeleoperationDone,
    461: StationKeeping,
    462: Elevator,
    463: FollowTrajectory,
    464: TrajectoryPoint,
    465: CustomManeuver,
    466: VehicleFormation,
    467: VehicleFormationParticipant,
    468: StopManeuver,
    469: RegisterManeuver,
    470: ManeuverControlState,
    471: FollowSystem,
    472: CommsRelay,
    473: CoverArea,
    474: PolygonVertex,
    475: CompassCalibration,
    476: FormationParameters,
    477: FormationPlanExecution,
    478: FollowReference,
    479: Reference,
    480: FollowRefState,
    481: FormationMonitor,
    482: RelativeState,
    483: Dislodge,
    484: Formation,
    485: Launch,
    486: Drop,
    487: ScheduledGoto,
    488: RowsCoverage,
    489: Sample,
    490: ImageTracking,
    491: Takeoff,
    492: Land,
    493: AutonomousSection,
    494: FollowPoint,
    495: Alignment,
    496: StationKeepingExtended,
    497: ManeuverDone,
    499: Magnetometer,
    500: VehicleState,
    501: VehicleCommand,
    502: MonitorEntityState,
    503: EntityMonitoringState,
    504: OperationalLimits,
    505: GetOperationalLimits,
    506: Calibration,
    507: ControlLoops,
    508: VehicleMedium,
    509: Collision,
    510: FormState,
    511: AutopilotMode,
    512: FormationState,
    513: ReportControl,
    514: StateReport,
    515: TransmissionRequest,
    516: TransmissionStatus,
    517: SmsRequest,
    518: SmsStatus,
    519: VtolState,
    520: ArmingState,
    521: TCPRequest,
    522: TCPStatus,
    525: AssetReport,
    550: Abort,
    551: PlanSpecification,
    552: PlanManeuver,
    553: PlanTransition,
    554: EmergencyControl,
    555: EmergencyControlState,
    556: PlanDB,
    557: PlanDBState,
    558: PlanDBInformation,
    559: PlanControl,
    560: PlanControlState,
    561: PlanVariable,
    562: PlanGeneration,
    563: LeaderState,
    564: PlanStatistics,
    600: ReportedState,
    601: RemoteSensorInfo,
    602: Map,
    603: MapFeature,
    604: MapPoint,
    606: CcuEvent,
    650: VehicleLinks,
    651: TrexObservation,
    652: TrexCommand,
    655: TrexOperation,
    656: TrexAttribute,
    657: TrexToken,
    658: TrexPlan,
    660: Event,
    702: CompressedImage,
    703: ImageTxSettings,
    750: RemoteState,
    800: Target,
    801: EntityParameter,
    802: EntityParameters,
    803: QueryEntityParameters,
    804: SetEntityParameters,
    805: SaveEntityParameters,
    806: CreateSession,
    807: CloseSession,
    808: SessionSubscription,
    809: SessionKeepAlive,
    810: SessionStatus,
    811: PushEntityParameters,
    812: PopEntityParameters,
    813: IoEvent,
    814: UamTxFrame,
    815: UamRxFrame,
    816: UamTxStatus,
    817: UamRxRange,
    818: UamTxRange,
    820: FormCtrlParam,
    821: FormationEval,
    822: FormationControlParams,
    823: FormationEvaluation,
    850: SoiWaypoint,
    851: SoiPlan,
    852: SoiCommand,
    853: SoiState,
    877: MessagePart,
    878: MessagePartControl,
    888: NeptusBlob,
    889: Aborted,
    890: UsblAngles,
    891: UsblPosition,
    892: UsblFix,
    893: ParametersXml,
    894: GetParametersXml,
    895: SetImageCoords,
    896: GetImageCoords,
    897: GetWorldCoordinates,
    898: UsblAnglesExtended,
    899: UsblPositionExtended,
    900: UsblFixExtended,
    901: UsblModem,
    902: UsblConfig,
    903: DissolvedOrganicMatter,
    904: OpticalBackscatter,
    905: Tachograph,
    906: ApmStatus,
    907: SadcReadings,
    908: DmsDetection,
    909: HomePosition,
    911: AbsoluteWind,
    912: AisInfo,
    913: ENCAwareness,
    915: Displacement,
    1014: CurrentProfile,
    1015: CurrentProfileCell,
    1016: ADCPBeam,
    1017: Frequency,
    1018: WaveSpectrumParameters,
    2000: GpioState,
    2001: EstimatedMugState,
    2002: GpioStateSet,
    2003: ColoredDissolvedOrganicMatter,
    2004: FluorescentDissolvedOrganicMatter,
    2006: TotalMagIntensity,
    2010: CommRestriction,
    2016: QueryTypedEntityParameters,
    2017: TypedEntityParameter,
    2018: ValuesIf,
    2021: VersionInfo,
    2022: TotalHeading,
    2035: BDI,
    2036: TypedEntityParameterEditor,
    2041: QueryBmsData,
    2042: BmsData,
    2043: BmsCellVoltage,
    2044: BmsRegister,
    2900: CameraFrame,
}

__all__ = [
    "ADCPBeam",
    "Abort",
    "Aborted",
    "AbsoluteWind",
    "Acceleration",
    "AcousticLink",
    "AcousticMessage",
    "AcousticOperation",
    "AcousticRelease",
    "AcousticRequest",
    "AcousticStatus",
    "AcousticSystems",
    "AcousticSystemsQuery",
    "AirSaturation",
    "Airflow",
    "AisInfo",
    "Alignment",
    "AlignmentState",
    "AllocatedControlTorques",
    "AngularVelocity",
    "Announce",
    "AnnounceService",
    "ApmStatus",
    "ArmingState",
    "AssetReport",
    "AutonomousSection",
    "AutopilotMode",
    "BDI",
    "BeamConfig",
    "BmsCellVoltage",
    "BmsData",
    "BmsRegister",
    "Boolean",
    "Brake",
    "ButtonEvent",
    "CLoopsMask",
    "CacheControl",
    "Calibration",
    "CameraFrame",
    "CameraZoom",
    "CcuEvent",
    "Chlorophyll",
    "ClockControl",
    "CloseSession",
    "Collision",
    "ColoredDissolvedOrganicMatter",
    "CommRestriction",
    "CommSystemsQuery",
    "CommsRelay",
    "CompassCalibration",
    "CompressedHistory",
    "CompressedImage",
    "Conductivity",
    "ControlLoops",
    "ControlParcel",
    "ControlledMode",
    "CoverArea",
    "CpuUsage",
    "CreateSession",
    "CrudeOil",
    "Current",
    "CurrentProfile",
    "CurrentProfileCell",
    "CustomManeuver",
    "DataSanity",
    "Depth",
    "DepthOffset",
    "DesiredControl",
    "DesiredHeading",
    "DesiredHeadingRate",
    "DesiredLinearState",
    "DesiredPath",
    "DesiredPitch",
    "DesiredRoll",
    "DesiredSpeed",
    "DesiredThrottle",
    "DesiredVelocity",
    "DesiredVerticalRate",
    "DesiredZ",
    "DevCalibrationControl",
    "DevCalibrationState",
    "DevDataBinary",
    "DevDataText",
    "DeviceState",
    "Dislodge",
    "Displacement",
    "DissolvedOrganicMatter",
    "DissolvedOxygen",
    "Distance",
    "DmsDetection",
    "Drop",
    "DvlRejection",
    "DynamicsSimParam",
    "ENCAwareness",
    "Elevator",
    "EmergencyControl",
    "EmergencyControlState",
    "EntityActivationState",
    "EntityInfo",
    "EntityList",
    "EntityMonitoringState",
    "EntityParameter",
    "EntityParameters",
    "EntityState",
    "EstimatedMugState",
    "EstimatedState",
    "EstimatedStreamVelocity",
    "EulerAngles",
    "EulerAnglesDelta",
    "Event",
    "ExtendedRSSI",
    "ExternalNavData",
    "FineOil",
    "Fluorescein",
    "FluorescentDissolvedOrganicMatter",
    "FollowPath",
    "FollowPoint",
    "FollowRefState",
    "FollowReference",
    "FollowSystem",
    "FollowTrajectory",
    "Force",
    "FormCtrlParam",
    "FormState",
    "Formation",
    "FormationControlParams",
    "FormationEval",
    "FormationEvaluation",
    "FormationMonitor",
    "FormationParameters",
    "FormationPlanExecution",
    "FormationState",
    "Frequency",
    "FuelLevel",
    "GetImageCoords",
    "GetOperationalLimits",
    "GetParametersXml",
    "GetWorldCoordinates",
    "Goto",
    "GpioState",
    "GpioStateSet",
    "GpsFix",
    "GpsFixRejection",
    "GpsFixRtk",
    "GpsNavData",
    "GroundVelocity",
    "GroupMembershipState",
    "GroupStreamVelocity",
    "Heartbeat",
    "HistoricCTD",
    "HistoricData",
    "HistoricDataQuery",
    "HistoricEvent",
    "HistoricSample",
    "HistoricSonarData",
    "HistoricTelemetry",
    "HomePosition",
    "IdleManeuver",
    "ImageTracking",
    "ImageTxSettings",
    "IndicatedSpeed",
    "IoEvent",
    "IridiumMsgRx",
    "IridiumMsgTx",
    "IridiumTxStatus",
    "Land",
    "Launch",
    "LblBeacon",
    "LblConfig",
    "LblEstimate",
    "LblRange",
    "LblRangeAcceptance",
    "LcdControl",
    "LeaderState",
    "LeakSimulation",
    "LedBrightness",
    "LinkLatency",
    "LinkLevel",
    "LogBookControl",
    "LogBookEntry",
    "LoggingControl",
    "Loiter",
    "LowLevelControl",
    "MagneticField",
    "Magnetometer",
    "ManeuverControlState",
    "ManeuverDone",
    "Map",
    "MapFeature",
    "MapPoint",
    "MessagePart",
    "MessagePartControl",
    "MonitorEntityState",
    "MsgList",
    "NavigationData",
    "NavigationUncertainty",
    "NeptusBlob",
    "OpLimitsMask",
    "OperationalLimits",
    "OpticalBackscatter",
    "PH",
    "PWM",
    "ParametersXml",
    "PathControlState",
    "PathPoint",
    "Phycocyanin",
    "Phycoerythrin",
    "PlanControl",
    "PlanControlState",
    "PlanDB",
    "PlanDBInformation",
    "PlanDBState",
    "PlanGeneration",
    "PlanManeuver",
    "PlanSpecification",
    "PlanStatistics",
    "PlanTransition",
    "PlanVariable",
    "PolygonVertex",
    "PopEntityParameters",
    "PopUp",
    "Power",
    "PowerChannelControl",
    "PowerChannelState",
    "PowerOperation",
    "Pressure",
    "ProfileSample",
    "Pulse",
    "PulseDetectionControl",
    "PushEntityParameters",
    "QueryBmsData",
    "QueryEntityActivationState",
    "QueryEntityInfo",
    "QueryEntityParameters",
    "QueryEntityState",
    "QueryLedBrightness",
    "QueryPowerChannelState",
    "QueryTypedEntityParameters",
    "RSSI",
    "RSSIUnits",
    "RamUsage",
    "Redox",
    "Reference",
    "RegisterManeuver",
    "RelativeHumidity",
    "RelativeState",
    "RemoteActions",
    "RemoteActionsRequest",
    "RemoteCommand",
    "RemoteSensorInfo",
    "RemoteState",
    "ReplayControl",
    "ReportControl",
    "ReportedState",
    "RestartSystem",
    "RhodamineDye",
    "Rows",
    "RowsCoverage",
    "Rpm",
    "SadcReadings",
    "Salinity",
    "Sample",
    "SaveEntityParameters",
    "ScheduledGoto",
    "ServoPosition",
    "SessionKeepAlive",
    "SessionStatus",
    "SessionSubscription",
    "SetControlSurfaceDeflection",
    "SetEntityParameters",
    "SetImageCoords",
    "SetLedBrightness",
    "SetPWM",
    "SetServoPosition",
    "SetThrusterActuation",
    "SimAcousticMessage",
    "SimulatedState",
    "Sms",
    "SmsRequest",
    "SmsRx",
    "SmsState",
    "SmsStatus",
    "SmsTx",
    "SoiCommand",
    "SoiPlan",
    "SoiState",
    "SoiWaypoint",
    "SonarData",
    "SoundSpeed",
    "SpeedUnits",
    "StateReport",
    "StationKeeping",
    "StationKeepingExtended",
    "StopManeuver",
    "StorageUsage",
    "SystemGroup",
    "SystemType",
    "TCPRequest",
    "TCPStatus",
    "Tachograph",
    "Takeoff",
    "Target",
    "TelemetryMsg",
    "Teleoperation",
    "TeleoperationDone",
    "Temperature",
    "TextMessage",
    "Throttle",
    "TotalHeading",
    "TotalMagIntensity",
    "TrajectoryPoint",
    "TransmissionRequest",
    "TransmissionStatus",
    "TransportBindings",
    "TrexAttribute",
    "TrexCommand",
    "TrexObservation",
    "TrexOperation",
    "TrexPlan",
    "TrexToken",
    "TrueSpeed",
    "Turbidity",
    "TypedEntityParameter",
    "TypedEntityParameterEditor",
    "UASimulation",
    "UAVType",
    "UamRxFrame",
    "UamRxRange",
    "UamTxFrame",
    "UamTxRange",
    "UamTxStatus",
    "UsblAngles",
    "UsblAnglesExtended",
    "UsblConfig",
    "UsblFix",
    "UsblFixExtended",
    "UsblModem",
    "UsblPosition",
    "UsblPositionExtended",
    "VSWR",
    "ValuesIf",
    "VehicleCommand",
    "VehicleFormation",
    "VehicleFormationParticipant",
    "VehicleLinks",
    "VehicleMedium",
    "VehicleOperationalLimits",
    "VehicleState",
    "VelocityDelta",
    "VersionInfo",
    "VerticalProfile",
    "Voltage",
    "VtolState",
    "WaterDensity",
    "WaterVelocity",
    "WaveSpectrumParameters",
    "WindSpeed",
    "YoYo",
    "ZUnits",
]
