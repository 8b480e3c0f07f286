"""The published manipulator: Tables I to III and Section 4 of the paper, computed."""
