"""Robot logs: MCAP files and LeRobot data sets, written from runs and read as recorded runs."""
