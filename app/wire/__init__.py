"""What is on the wire: frames, byte codecs, the passive decoder and the live state. Pure, no clock."""
