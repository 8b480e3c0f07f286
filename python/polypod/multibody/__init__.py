"""A mechanism as links, elementary joints and loop closures: what other engines and formats build on.

Made from the mechanism file's numbers alone, apart from Polypod's equations, which it serves to check.
"""
