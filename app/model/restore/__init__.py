"""A restore before anything is sent: which values go where, in which order, and what must hold before. Pure."""
