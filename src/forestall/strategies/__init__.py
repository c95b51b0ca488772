"""When a run may be interrupted: none · proactive. They see only L0."""
