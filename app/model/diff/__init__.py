"""What differs between any number of devices and sets. Pure."""
