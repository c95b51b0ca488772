"""A robot in trouble: faulty worlds and parts, and what a run does then."""
