"""VirtualHome: its published programs and its evolving graph, for who has the packages."""
