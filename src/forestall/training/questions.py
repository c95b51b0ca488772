"""Attributes in the order in which pictures and encoders keep them; calls nothing.

Shards on disk number attributes and values by this table, so that it stays as it is.
"""

ATTRIBUTES: dict[str, tuple[str, ...]] = {
    "open": ("closed", "open"),
    "toggled": ("off", "on"),
    "filled": ("empty", "water", "coffee", "wine"),
    "dirty": ("clean", "dirty"),
    "sliced": ("whole", "sliced"),
    "broken": ("intact", "broken"),
    "cooked": ("raw", "cooked"),
    "temperature": ("room", "hot", "cold"),
}
"""Attribute → its values, the default of a new object first."""
