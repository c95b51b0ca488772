"""Skills as a planning domain: validate any plan, ground, search, export."""
