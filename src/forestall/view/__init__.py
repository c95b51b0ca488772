"""The local view: an index over runs and experiments on disk, their pages, runs as they happen."""
