"""Motions and simulations solved, and what follows from a solution."""
