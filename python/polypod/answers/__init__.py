"""Answers of a mechanism: named arrays over a batch of states, as datasets and as cards."""
