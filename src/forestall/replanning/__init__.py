"""The corrected plan: by our own planner, or by a language model."""
