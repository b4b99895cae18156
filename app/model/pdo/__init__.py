"""PDO configuration of a node: what it is, what is wrong with it, how it is written, what it costs. Pure."""
