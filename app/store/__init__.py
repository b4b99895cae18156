"""What is kept: users, sessions, visits, the audit log, favourites and settings, in one SQLite file."""
