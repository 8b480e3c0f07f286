"""A mechanism file's tables, read into SI."""

from __future__ import annotations

import math

import numpy as np

from support.oracle.rotations import turn

UNITS = {
    "length": {"m": 1.0, "mm": 1e-3, "cm": 1e-2, "um": 1e-6, "in": 0.0254},
    "angle": {"rad": 1.0, "deg": math.pi / 180},
    "mass": {"kg": 1.0, "g": 1e-3, "lb": 0.45359237},
    "inertia": {"kg m^2": 1.0, "kg mm^2": 1e-6, "g mm^2": 1e-9},
    "force": {"N": 1.0, "kN": 1e3, "mN": 1e-3},
    "torque": {"N m": 1.0, "N mm": 1e-3, "kN m": 1e3},
    "acceleration": {"m/s^2": 1.0, "mm/s^2": 1e-3},
}


def read(d: dict) -> dict:
    """The SI description of a mechanism file's tables."""
    scale = {kind: UNITS[kind][name] for kind, name in d.get("units", {}).items()}
    length, angle = scale.get("length", 1.0), scale.get("angle", 1.0)

    def point(p):
        if isinstance(p, dict):
            a = p["angle"] * angle
            p = [p["radius"] * math.cos(a), p["radius"] * math.sin(a), p.get("z", 0.0)]
        return np.array(p, float) * length

    def axis(a):
        if a is None:
            return None
        if isinstance(a, dict):
            a = [math.cos(a["angle"] * angle), math.sin(a["angle"] * angle), a.get("z", 0.0)]
        return np.array(a, float) / np.linalg.norm(a)

    def body(b, along_leg=0):
        if b is None:
            return None
        c = b.get("center", 0.0 if along_leg else [0, 0, 0])
        c = np.array(c, float) if np.ndim(c) else np.array([0, along_leg * c, 0.0])
        inertia = np.array(b.get("inertia", 0.0), float)
        inertia = inertia * np.eye(3) if inertia.ndim < 2 else inertia
        mass = b["mass"] * scale.get("mass", 1.0)
        return {"mass": mass, "center": c * length, "inertia": inertia * scale.get("inertia", 1.0)}

    rods = d.get("rods", [])
    names = [r["name"] for r in rods]

    def joint(j):
        rod = names.index(j["rod"]) if "rod" in j else None
        return {
            "joint": j["joint"],
            "point": point(j["point"]),
            "axis": axis(j.get("axis")),
            "normal": axis(j.get("normal")),
            "rod": rod,
        }

    dynamics, load, home, tool = (d.get(k, {}) for k in ("dynamics", "load", "home", "tool"))
    return {
        "name": d["name"],
        "platform": body(d.get("platform")),
        "rods": [
            {
                "name": r["name"],
                "point": point(r["point"]),
                "axis": axis(r["axis"]),
                "body": body(r) if "mass" in r else None,
            }
            for r in rods
        ],
        "legs": [
            {
                "name": leg.get("name", str(i + 1)),
                "actuated": leg.get("actuated", True),
                "stroke": [v * length for v in (leg["stroke"]["min"], leg["stroke"]["max"])]
                if "stroke" in leg
                else None,
                "base": joint(leg["base"]),
                "platform": joint(leg["platform"]),
                "cylinder": body(leg.get("cylinder"), along_leg=1),
                "piston": body(leg.get("piston"), along_leg=-1),
            }
            for i, leg in enumerate(d["legs"])
        ],
        "gravity": np.array(dynamics.get("gravity", [0, 0, -9.81]), float) * scale.get("acceleration", 1.0)
        if "gravity" in dynamics
        else np.array([0, 0, -9.81]),
        "efficiency": dynamics.get("efficiency", 1.0),
        "linear_damping": dynamics.get("linear_damping", 0.0),
        "angular_damping": dynamics.get("angular_damping", 0.0),
        "load": {
            "force": np.array(load.get("force", [0, 0, 0]), float) * scale.get("force", 1.0),
            "torque": np.array(load.get("torque", [0, 0, 0]), float) * scale.get("torque", 1.0),
            "axes": load.get("axes", "base"),
        },
        "home": {
            "position": np.array(home["position"], float) * length,
            "rotation_vector": np.array(home.get("rotation_vector", [0, 0, 0]), float) * angle,
        },
        "tool": {"point": point(tool.get("point", [0, 0, 0])), "axis": axis(tool.get("axis", [0, 0, 1]))},
    }


def home(spec):
    return turn(spec["home"]["rotation_vector"]), spec["home"]["position"]


LU_ANGLES = (18.0, 90.0, 162.0, 234.0, 306.0)


def lu() -> dict:
    """The paper's mechanism, Table II, as a file's tables. At home m is parallel to B, 740 mm above it."""
    legs = []
    for i, theta in enumerate(LU_ANGLES):
        on_rod = i in (0, 2)
        base = {"joint": "R", "rod": "L"} if on_rod else {"joint": "S"}
        base["point"] = {"radius": 270 if on_rod else 265, "angle": theta}
        inward = [-math.cos(math.radians(theta)), -math.sin(math.radians(theta)), 0]
        platform = {"joint": "U", "axis": [1, 0, 0] if on_rod else inward}
        platform["point"] = {"radius": 150, "angle": theta}
        piston = {"mass": 3, "center": 100 if on_rod else 98, "inertia": 3}
        cylinder = {"mass": 2, "center": 50, "inertia": 2}
        stroke = {"min": 650, "max": 850}
        legs.append(
            {"base": base, "platform": platform, "piston": piston, "cylinder": cylinder, "stroke": stroke}
        )
    s18 = math.sin(math.radians(18))
    return {
        "name": "lu-3spu-2rpu-r",
        "units": {
            "length": "mm",
            "angle": "deg",
            "mass": "kg",
            "inertia": "kg m^2",
            "force": "N",
            "torque": "N m",
        },
        "load": {"force": [10, 10, 500], "torque": [0, 0, 1000]},
        "home": {"position": [0, 120 * s18, 740]},
        "platform": {"mass": 3, "center": [0, 0, 0], "inertia": 5},
        "rods": [
            {
                "name": "L",
                "point": [0, 270 * s18, 0],
                "axis": [1, 0, 0],
                "mass": 2,
                "center": [0, 0, 0],
                "inertia": 2,
            }
        ],
        "legs": legs,
    }
