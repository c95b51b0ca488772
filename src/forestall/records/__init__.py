"""The record of a run: building, coding, and facts derived from it."""
