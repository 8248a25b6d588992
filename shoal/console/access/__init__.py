"""Users, sessions, certificates, and who commands."""
