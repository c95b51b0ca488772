"""What is counted over the rows of experiments."""
