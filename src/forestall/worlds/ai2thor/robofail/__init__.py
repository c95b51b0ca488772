"""RoboFail, the failures that REFLECT recorded in AI2-THOR, as a data set (`docs/robofail.md`)."""
