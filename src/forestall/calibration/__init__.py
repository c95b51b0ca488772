"""From the scores of successful runs to thresholds with a bound on false alarms; pure, numpy."""
