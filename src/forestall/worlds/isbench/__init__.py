"""IS-Bench: plans of others and the conditions around their steps, as domains with safety rules."""
