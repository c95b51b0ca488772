"""AI2-THOR as a world: the real package's Controller behind the seams (`docs/ai2thor.md`)."""
