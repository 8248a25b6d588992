"""Options of shipped vehicles for tests that do without a log, or without a camera."""

UNLOGGED = "Transports.Logging:Enabled=Never"  # a sixth less to compute, and the same run: test_without_a_log.py
BLIND = "Simulators.MUGDetectionCamera:Enabled=Never"  # of the AUV: another sixth
