"""Incidents: stretches of recordings with what people say of them, and how they leave this computer and come to it."""
