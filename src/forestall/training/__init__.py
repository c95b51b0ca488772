"""Making the shipped image-text encoder: pictures, training, export, measurement (tool layer)."""
