"""What is on the wire: frames, byte codecs, passive decoders, the live state. Pure."""
