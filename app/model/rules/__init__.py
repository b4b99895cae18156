"""Rules over the values of a station: what is dangerous, what cannot work, what is worth a look. Pure functions."""
