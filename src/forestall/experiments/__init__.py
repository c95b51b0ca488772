"""The paper's experiments: many episodes on one machine or a cluster, tables, figures, a page."""
