"""Records, pages and progress: reads finished records and listens, changes nothing."""
