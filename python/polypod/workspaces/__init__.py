"""Workspaces: reachable, sliced, or over a lattice of leg lengths; their boundary and their files."""
