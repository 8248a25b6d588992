"""What can be done with logs: summed up, cut, merged, compared, repaired, shown, exported."""
