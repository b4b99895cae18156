"""What a device is: descriptions, values, sets, rules. Pure: no bus, no clock, no files but its own data."""
