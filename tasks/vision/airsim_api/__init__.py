"""Interface of AirSim, Colosseum and Cosys-AirSim: requests, answers, clock, and the mount of a camera."""
