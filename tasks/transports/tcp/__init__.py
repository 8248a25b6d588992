"""IMC over TCP: a server, and a client of another one."""
