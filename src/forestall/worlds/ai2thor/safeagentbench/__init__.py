"""SafeAgentBench: plans of others for AI2-THOR, and the final states of hazardous ones as rules."""
