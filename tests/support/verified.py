"""Common parts of the tests of all twins: disagreeing quantities, and faults in a mechanism file's tables."""


def exceeding(found):
    """The quantities whose errors are beyond their tolerance."""
    return {row.quantity for row in found.comparisons[0].rows if row.relative_max > row.tolerance}


def turn_gravity(tables):
    tables["dynamics"]["gravity"] = [-g for g in tables["dynamics"]["gravity"]]


def forget_efficiency(tables):
    tables["dynamics"]["efficiency"] = 1.0


def forget_damping(tables):
    tables["dynamics"]["angular_damping"] = 0.0


def mirror_center(tables):
    link = tables["legs"][1]["piston"]
    link["center"] = [-link["center"][0], *link["center"][1:]]


def rod_center(tables):
    tables["rods"][0]["center"] = [-c for c in tables["rods"][0]["center"]]
