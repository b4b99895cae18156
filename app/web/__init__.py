"""The page's server: routes, socket, guards. No logic."""
