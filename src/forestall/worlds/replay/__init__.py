"""A recorded run as a world that can be looked at."""
