"""The page in the browser: a mechanism drawn to scale, moved by its coordinates, its legs, or a motion.

`model` and `player` hold what is shown, without a browser; `scene` and `panel` show it with viser, an
optional package; `html` writes the texts; `server` and `static` make the live page and the one that plays
without a server.
"""
