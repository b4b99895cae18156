"""PDO setup of a node: seen on the wire, previewed, written as one change, and put back (``desk`` is the way in)."""
