"""Replay of recordings: one cursor for all who look, owned by the server. Nothing here can reach a device."""
