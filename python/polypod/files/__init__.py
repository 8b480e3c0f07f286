"""Files from the outside: text, TOML, CSV, units, and the tables of a mechanism file."""
