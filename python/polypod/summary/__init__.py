"""Mechanisms and solutions as plain data, and as tables of text."""
