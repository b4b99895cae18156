"""The library of parameter sets: what was taken when, tags, nameplates, files, and sets out of recordings."""
