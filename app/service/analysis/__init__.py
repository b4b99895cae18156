"""What a recording tells about a trip: what came first, where a signature is found again, how incidents compare."""
