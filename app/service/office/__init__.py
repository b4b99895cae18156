"""People and their work: users, sessions, visits, the audit log."""
