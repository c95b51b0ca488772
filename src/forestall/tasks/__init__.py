"""Tasks, scenarios, faults, goal checks and measurements; sees the simulator's truth."""
