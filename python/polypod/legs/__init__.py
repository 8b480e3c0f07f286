"""Kinds of joints and of drives: what a leg is made of, each kind in one place."""
