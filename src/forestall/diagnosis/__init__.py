"""Why the scene does not fit, and what must change."""
