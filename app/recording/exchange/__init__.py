"""Recordings to and from what others read: candump, ASC, BLF, TRC, CSV, Parquet; cut, merged and anonymised copies."""
