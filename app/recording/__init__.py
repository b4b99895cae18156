"""MCAP recordings: writer, reader, recovery, archive form."""
