"""How we ask a device: one module a bus, behind a small async contract."""
