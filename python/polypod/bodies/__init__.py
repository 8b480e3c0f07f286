"""The links of a mechanism as solid bodies, and their colours."""
