"""What differs between a kitchen, a bench and a warehouse, as one frozen object read from files.

Called by everything above; calls `types` and `errors` only.
"""
