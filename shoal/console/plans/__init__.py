"""Plans: files, simulated flights and forecasts."""
