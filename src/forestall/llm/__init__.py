"""Language models: an endpoint asked, its answers recorded and replayed, prompts and parsing."""
