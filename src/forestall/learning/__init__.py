"""A domain learnt from demonstrations alone: what they use, what held, what changed."""
