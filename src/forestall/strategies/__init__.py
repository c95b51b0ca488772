"""When a run may be interrupted: none · watch · proactive · online · post-hoc. They see only L0."""
