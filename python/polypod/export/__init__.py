"""Mechanisms and results in the formats of other tools: MJCF, SDF, URDF, GLB, STL, CSV, NetCDF and MAT."""

from polypod.export.formats import FORMATS, Exported, export

__all__ = ["FORMATS", "Exported", "export"]
