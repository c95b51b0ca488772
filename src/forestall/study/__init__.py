"""The human study of the paper: which of two explanations says better why a run fails."""
