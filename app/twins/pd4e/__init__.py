"""Digital twin of the Nanotec PD4-E: a servo with its controller behind a Modbus TCP server.

``device`` puts the parts together; ``server`` serves it. What is simulated, what is assumed and what is missing stands
in ``docs/twin-pd4e.md``. Where the known parts of the manual leave a rule out, the code says OPEN, or *sibling* where
the rule is that of other drives of the same maker; a driver must find such things out on the device.
"""
