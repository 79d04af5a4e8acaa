"""Studies of many runs: sweeps, derivatives through time, calibration."""
