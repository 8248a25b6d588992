"""The tasks of DUNE by group: those of its source tree, and those that only its ini files name."""

_NAMES = {
    "Actuators": """
        AMC Broom Broomv2 Dice DorisSampler FLIRPTU IDX56 LED4R LinuxPWM MCD4R MicroCamD OREO PMM PTUD48 PWM
        PWMBBB PWMv2 ROSInspector RampSampler RaspberryPiPWM SCRT SCRTv4 SIMCT01 SingleSIMCT01 TASE Torqeedo
        WASABi WOREO
    """,
    "Autonomy": """
        CoMap OnEvent TREX TextActions
    """,
    "Control": """
        ASV.Autopilot ASV.Conventional.Heading ASV.Conventional.RemoteOperation ASV.Conventional.Speed
        ASV.Differential.HeadingAndSpeed ASV.Differential.RemoteOperation ASV.HeadingAndSpeed
        ASV.RemoteOperation ASV.RemoteOperation.DifferentialThrust ASV.RemoteOperation.ThrusterAndRudder
        AUV.Allocator AUV.Attitude AUV.Attitude_CP AUV.Diving AUV.LMI AUV.RemoteOperation AUV.Speed
        AUV.Speed_Geom AUV.Speed_HandPos Actuators.AntennaTracker Actuators.Thruster.PWM AntennaTracker
        Ardupilot PTU PTU2 Path.Aerosonde Path.CAS Path.COLAV.ColavSbmpc Path.COLAV.ColavSbmpcILOS
        Path.COLAV.ColavSbmpcNegotiation Path.COLAV.TargetTracking Path.Formation.Controller
        Path.Formation.Coordinator Path.Formation.Test Path.Geometric Path.HandPos Path.Height Path.ILOS
        Path.LOSLeg Path.LOSnSMC Path.Profiler Path.PurePursuit Path.PurePursuitOA Path.ROV Path.SMC
        Path.VectorField Path.VectorFieldnMultiLoiter Pioneer ROV.Depth ROV.HorizontalPlane
        ROV.HorizontalPlaneV2 ROV.RemoteOperation UAV.Arducopter UAV.Ardupilot UAV.Ardupilot.RemoteOperation
        UAV.LOS UAV.Leg_LOSTriang UAV.PX4 UAV.RemoteOperation
    """,
    "Drivers": """
        CrawlerSerial
    """,
    "Maneuver": """
        CommsRelay CompassCalibration CoverArea Docking Dubin Elevator FlyByCamera FollowPath FollowPoint
        FollowReference FollowReference.AUV FollowReference.UAV FollowSystem FollowTarget FollowTrajectory
        FollowTrajectory.PID FormationCP Goto Idle Loiter Multiplexer PopUp Rows RowsCoverage Sampling
        StationKeeping Teleoperation VehicleFormation.Coordinator VehicleFormation.FormCollAvoid
        VehicleFormation.LeaderFollowers.Leader VehicleFormation.SMC VehicleFormation.Swarm
        VehicleFormation.Test YoYo
    """,
    "Monitors": """
        AcousticModemsSelector Boot CPU CPUScaling CPUSingleUsage Clock Collisions DUNEResources EVERUN
        Emergency Entities FuelLevel HostResources LifeCycle Log LostComms MantaFuelLevel Medium NavError
        NavigationLight Obstacles OperationalLimits Payload Producer SAM Servos StateReport Temperature
        TemperatureRpi Thrusters Uptime ZeroTier
    """,
    "Navigation": """
        AUV.CLRanger AUV.Navigation AUV.Ranger AUV.SGNavigation Attitude.EKF General.AHRS.AN4248
        General.AHRS.Madgwick General.AHRS.Mahony General.Alignment General.Estimator General.GNSS
        General.GPSNavigation General.LBL General.NavManager General.Profiler General.ROV Trilateration
    """,
    "Payload": """
        RedX
    """,
    "Plan": """
        DB Engine Generator
    """,
    "Power": """
        APC APD BATMANv2 CPC CPMB CPMBH CPMBv2 DOAMv1 DOAMv2 INA219 LEDCON LUEMB MCBv1 MCBv2 OPCON OREO PARSEC
        PCTLv2 PSIMAR WRPD
    """,
    "Security": """
        DtlsClient DtlsServer
    """,
    "Sensors": """
        ADAM6017 AIM104MultiIO AIS AIS650 AirMar120WX AirMar220WX Antaris4 BCM283x BlueView BlueView4 CoreTemp
        CyclopsC7 DLV3 DMS DMSv2 DataStore DeepVisionOSM2 EcoPuck EcoPuckTriple Edgetech2205 EmulatedGPS
        EmulatedPPS ExplorerDVL FT742 FT743 GPS Genesys GillWindObserverII HC2A HG1700 HMC5883L HemisphereV200s
        IFOG IIM42652 Imagenex837B Imagenex852 Imagenex863 Imagenex872 Imagenex881A ImuDynamicTest Keller
        Klein3500 LIMU LIMUOriginal LIS2MDL MCC1608G MCP9800 MLBL MLBLTracker MOTUS5729 MPU9250 MPU9250Interface
        MPU9250Serial MTi MetrecX Microstrain3DMGX1 Microstrain3DMGX3 Microstrain3DMGX3OG MicrostrainMIP MiniSVS
        NavQuestDVL Navio.GPS Navio.IMU NortekADCP NortekDVL OEMX OS4000 Optode4531 Optode4831 Optode4835 PPS
        PTU300 PiHat Piccolo.Telemetry RBRlegato3 RaspberryPiSenseHatv2 SADC SBE49FastCAT SCH311X SDCR SW100
        SigFox SmartX SonTekArgonaut TPTLRa Temperature TemperatureLon ThermalZone V104setup VantagePro2 WT901C
        WaterLinkedDVL WifiRSSI WorkhorseNavigator XR620CTD XchangeSV
    """,
    "Simulators": """
        AIS AUV AcousticModem Autopilot CDC3 CTD DVL DepthSensor Docking DockingUSBL Dummy Environment
        EvoSimulator GPS Gaussian Heave IMU Iridium IridiumMail LBL Leaks Motor Multicopter Power Producer
        Reporter SVS Servos SimInterface SimpleAcousticModem StreamSpeed StreamVelocity Target UAV UAVAutopilot
        USBL UnderwaterAcoustics VSIM
    """,
    "Supervisors": """
        AUV.Assist AUV.LostComms Autonaut Climb Clock ClockPPS Delegator Emergency Entities Grounding LogChanger
        LostComms MobileInternet Power PowerManager Reporter SamplingSender Service SlaveCPU StarLink
        StratoPIWatchdog UAV.LostComms Vehicle
    """,
    "Transports": """
        Acomms AirOS Announce ArdupilotSITL Benthos Cache CommManager DCCL DataStore DataStore.Receiver
        DataStore.Sender Discovery DistributedBus EvoRoma Evologics FTP FTP.Client FalkorData FlightGear
        Fragments GSM HTTP Iridium IridiumOperation IridiumSBD Janus LDNS Leviathan LogBook Logging
        LoggingDigest LoggingURR4OS MQTT Micromodem MobileInternet Noptilus Piccolo.Link Radio Replay Routing
        Rsync SMS SUNSET SatComms Satellite Seatrac Serial SerialOverTCP TCP.AcousticProxy TCP.Client TCP.Server
        TCPOnDemand UAN UDP USBLRequests WebLink
    """,
    "UserInterfaces": """
        AcousticModemsSelector Buttons ButtonsRPI LCD LEDs MantaCore MantaPanel NavioLED RCViaArdupilot
        Webpage.Core Webpage.DiscoveryTool Webpage.Dummy Webpage.PowerChannels Webpage.Sensors
    """,
    "Vision": """
        AD080GE DFK51BG02H FireMapper Flir FrameGrabber Gobi384 Lumenera PhotoTrigger Pioneer PointGrey
        RpiHqCamera UAVCamera UI2210MGL
    """,
}

TASKS = frozenset(f"{group}.{name}" for group, names in _NAMES.items() for name in names.split())
