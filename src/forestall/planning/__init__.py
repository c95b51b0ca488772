"""Skills as a planning domain: validate any plan, translate, search, export."""
