"""How long a test waits for what may hang: no limit here measures speed."""

HANGS = 900.0
"""Seconds after which what takes some of them, on a machine of its own, counts as hanging."""
